#pragma once

#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::host {

/// What a program printed on both outputs, and its exit code.
struct ProgramOutput {
  int code = 0;
  std::vector<std::string> lines;  ///< the first of them, where it prints very many
};

/// Runs it until it ends. Errc::timeout: it had not by the deadline, and is ended. Errc::not_found: there is none.
Result<ProgramOutput> output_of(const std::vector<std::string>& command, Deadline deadline);

}  // namespace birdseye::host
