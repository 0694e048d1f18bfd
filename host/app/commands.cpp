#include "host/app/commands.hpp"

#include "drivers/system/program.hpp"

namespace birdseye::host {

void CommandStatus::take(const Result<void>& outcome) {
  if (!outcome) refuse(outcome.error());
}

void CommandStatus::refuse(const Error& error) {
  print_error("birdseye", error.what);
  code = ExitCode::unusable_input;
}

}  // namespace birdseye::host
