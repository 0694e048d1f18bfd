#pragma once

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye {

/// Both ends of a pipe, which no program that is started inherits.
struct Pipe {
  static Result<Pipe> open();

  UniqueFd out;  ///< to read from
  UniqueFd in;   ///< to write to
};

}  // namespace birdseye
