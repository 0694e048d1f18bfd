#pragma once

#include <algorithm>
#include <cstddef>

namespace birdseye {

inline constexpr double kNormal95 = 1.959963985;  ///< student95() where sigma is known

/// The two-sided 95 % point of Student's distribution: how many sigmas a 95 % bound reaches whose sigma rests on so
/// many degrees of freedom. Cornish and Fisher's expansion about the normal point (M. Abramowitz and I. Stegun,
/// Handbook of Mathematical Functions, 26.7.5).
inline double student95(int degrees_of_freedom) {
  constexpr double z = kNormal95;
  const double n = std::max(1, degrees_of_freedom), z3 = z * z * z, z5 = z3 * z * z, z7 = z5 * z * z;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n) +
         (3 * z7 + 19 * z5 + 17 * z3 - 15 * z) / (384 * n * n * n);
}

/// By how much longer a 95 % bound is whose sigma rests on so few groups than one whose sigma is known.
inline double few_groups_factor(std::size_t groups) {
  return student95(static_cast<int>(groups) - 1) / kNormal95;
}

}  // namespace birdseye
