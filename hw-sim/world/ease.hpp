#pragma once

#include <algorithm>

namespace birdseye::hw_sim {

/// From 0 to 1 as u goes from 0 to 1, at rest at both ends.
inline double ease(double u) {
  u = std::clamp(u, 0.0, 1.0);
  return u * u * (3 - 2 * u);
}

}  // namespace birdseye::hw_sim
