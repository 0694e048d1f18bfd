#pragma once

#include <Eigen/Core>
#include <numbers>

#include "hw-sim/minibird/tracker_script.hpp"

namespace birdseye::hw_sim {

/// A circle about the z axis that says what time it is: at t the first bird is at centre + radius (cos wt, sin wt, 0),
/// turned by Rz(wt), w = 2 pi / period. Each further bird is ahead by phase_rad.
struct Circle {
  Eigen::Vector3d centre_mm{400, 0, 0};
  double radius_mm = 200;
  double period_s = 2;
  double phase_rad = std::numbers::pi / 4;

  [[nodiscard]] BirdPose pose(std::size_t bird, double t_s) const;
};

/// t counts from zero_ns.
Motion circle_motion(const Circle& circle, std::int64_t zero_ns);
/// Each bird for itself at (400, 60 * bird, 0) mm, not turned.
Motion still_motion();

}  // namespace birdseye::hw_sim
