#include "host/app/commands.hpp"

#include <fmt/core.h>

namespace birdseye::host {

void CommandStatus::take(const Result<void>& outcome) {
  if (!outcome) refuse(outcome.error());
}

void CommandStatus::refuse(const Error& error) {
  fmt::print(stderr, "birdseye: {}\n", error.what);
  code = ExitCode::unusable_input;
}

}  // namespace birdseye::host
