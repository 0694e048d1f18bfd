#include "host/app/commands.hpp"

#include <filesystem>

#include "calibration/base/lower_case.hpp"
#include "drivers/system/program.hpp"

namespace birdseye::host {

void CommandStatus::take(const Result<void>& outcome) {
  if (!outcome) refuse(outcome.error());
}

void CommandStatus::refuse(const Error& error) {
  print_error("birdseye", error.what);
  code = ExitCode::unusable_input;
}

std::string png_name(const std::string& file) {
  return lower_case(std::filesystem::path(file).extension().string()) == ".png"
             ? ""
             : file + ": is written as PNG; name it .png";
}

}  // namespace birdseye::host
