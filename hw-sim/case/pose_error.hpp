#pragma once

#include <cstdint>
#include <vector>

#include "calibration/geometry/transform.hpp"

namespace birdseye::hw_sim {

/// How the poses that a case states err from the true ones.
struct PoseError {
  double noise_mm = 0, noise_deg = 0;    ///< of the tracker: a standard deviation for each axis and view
  double offset_mm = 0, offset_deg = 0;  ///< of hand-eye: one shift and one turn of this size for all views
  [[nodiscard]] bool any() const { return noise_mm > 0 || noise_deg > 0 || offset_mm > 0 || offset_deg > 0; }
};

/// The poses as an operation would have them: those of a tracker's sensor on the scope's handle, 280 mm behind the
/// lens, with noise of their own, taken to the lens by a hand-eye calibration that is off. Drawn by the seed; the same
/// draws, only larger, for larger errors.
std::vector<Transform<Camera, Patient>> tracked_poses(const std::vector<Transform<Camera, Patient>>& truth,
                                                      const PoseError& error, std::uint64_t seed);

}  // namespace birdseye::hw_sim
