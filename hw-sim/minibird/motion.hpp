#pragma once

#include <Eigen/Core>
#include <numbers>
#include <string>

#include "hw-sim/minibird/tracker_script.hpp"

namespace birdseye::hw_sim {

/// A circle about the z axis, on which the pose tells the time: at t the first bird is at centre + radius (cos wt, sin
/// wt, 0), turned by Rz(wt), w = 2 pi / period. Each further bird is ahead by phase_rad.
struct Circle {
  Eigen::Vector3d centre_mm{400, 0, 0};
  double radius_mm = 200;
  double period_s = 2;
  double phase_rad = std::numbers::pi / 4;

  [[nodiscard]] BirdPose pose(std::size_t bird, double t_s) const;
};

/// A pointer whose tip stands in a divot while its handle is led round in widening and narrowing cones and turned about
/// its own length. All birds move alike, further ones beside the first.
struct PivotMotion {
  Eigen::Vector3d tip_in_sensor_mm{158, -6, 11}, pivot_in_tracker_mm{400, 20, 60};
  double most_tilt_deg = 38, round_s = 3, widening_s = 11, spin_deg = 25;

  [[nodiscard]] BirdPose pose(std::size_t bird, double t_s) const;
};

/// The motion on a circle; t counts from zero_ns.
BirdMotion circle_motion(const Circle& circle, std::int64_t zero_ns);
BirdMotion pivot_motion(const PivotMotion& pivot, std::int64_t zero_ns);
/// Each bird rests at (400, 60 * bird, 0) mm, not turned.
BirdMotion still_motion();

/// The motion "circle", "pivot" or "still" with its default parameters but for the circle's period; the circle for any
/// other name.
BirdMotion motion_named(const std::string& name, double circle_period_s, std::int64_t zero_ns);

}  // namespace birdseye::hw_sim
