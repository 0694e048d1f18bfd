#pragma once

#include <algorithm>

namespace birdseye::host {

/// Twice how much the parabola through three scores a step apart bends, downwards positive; never quite 0.
inline float bend_of(float before, float at, float after) {
  return std::max(1e-6F, 2 * at - before - after);
}

/// Where the peak of the parabola through three scores a step apart lies, in steps from the middle one: at most half.
inline double peak_between(float before, float at, float after) {
  return std::clamp(0.5 * static_cast<double>((after - before) / bend_of(before, at, after)), -0.5, 0.5);
}

}  // namespace birdseye::host
