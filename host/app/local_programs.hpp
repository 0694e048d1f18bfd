#pragma once

#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A program that is installed, or built, beside this one.
std::string beside_us(const std::string& name);
/// A TCP port that is free now on the loopback interface.
Result<int> free_port();

}  // namespace birdseye::host
