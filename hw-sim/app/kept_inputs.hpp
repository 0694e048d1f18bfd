#pragma once

#include <filesystem>
#include <initializer_list>
#include <system_error>

#include "calibration/base/result.hpp"

namespace birdseye::hw_sim {

/// Refuses an output that is one of the inputs, by whatever name; empty paths are passed over.
inline Result<void> keep_inputs(std::initializer_list<std::filesystem::path> outputs,
                                std::initializer_list<std::filesystem::path> inputs) {
  for (const std::filesystem::path& output : outputs) {
    for (const std::filesystem::path& input : inputs) {
      std::error_code ignored;
      if (output.empty() || input.empty() || !std::filesystem::equivalent(output, input, ignored)) continue;
      return Error{Errc::bad_value, output.string() + ": is read by this command; write elsewhere"};
    }
  }
  return {};
}

}  // namespace birdseye::hw_sim
