#pragma once

#include <stop_token>

#include "device/birdseyed/config.hpp"

namespace birdseye::device {

/// Opens each instrument that is configured, prints a line of what it is, and closes it. The error has a line for each
/// instrument that cannot be used.
Result<void> probe(const Config& config, const std::stop_token& stop);

}  // namespace birdseye::device
