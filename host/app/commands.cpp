#include "host/app/commands.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

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

namespace {

namespace fs = std::filesystem;

bool is_output(const CLI::Option& option) {
  constexpr std::array kOutputs{"--out", "--json", "--report", "--picture"};
  return std::ranges::any_of(kOutputs, [&option](const char* name) { return option.check_name(name); });
}

void check_outputs(const CLI::App& command) {
  const auto options = command.get_options();
  for (const CLI::Option* const out : options) {
    if (!is_output(*out)) continue;
    for (const std::string& path : out->results()) {
      std::error_code ignored;
      if (!fs::is_regular_file(path, ignored)) continue;
      for (const CLI::Option* const in : options) {
        if (is_output(*in)) continue;
        const bool read = std::ranges::any_of(
            in->results(), [&](const std::string& given) { return fs::equivalent(given, path, ignored); });
        if (read) {
          throw CLI::ValidationError(out->get_name(), path + " is read, by " + in->get_name() +
                                                          ", and would be written over; name another file");
        }
      }
    }
  }
}

}  // namespace

void refuse_outputs_over_inputs(CLI::App& app) {
  app.parse_complete_callback([&app] { check_outputs(app); });
  for (CLI::App* const command : app.get_subcommands({})) refuse_outputs_over_inputs(*command);
}

std::string png_name(const std::string& file) {
  return lower_case(std::filesystem::path(file).extension().string()) == ".png"
             ? ""
             : file + ": is written as PNG; name it .png";
}

}  // namespace birdseye::host
