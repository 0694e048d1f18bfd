#pragma once

#include <cstddef>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// Processor seconds that nothing but copying one frame's pixels in from a Unix socket and out to so many others takes,
/// here and now: what any program that passes frames on must spend.
Result<double> copy_s_per_frame(std::size_t bytes, int outputs);

}  // namespace birdseye::host
