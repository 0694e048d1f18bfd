#pragma once

#include <string>

namespace birdseye::drivers {

/// Whether a Linux of this release stamps the edges of GPIO lines with CLOCK_MONOTONIC: before 5.7 it was the time of
/// day, which is set and leaps. False for a text that is no release.
bool stamps_edges_monotonic(const std::string& release);

}  // namespace birdseye::drivers
