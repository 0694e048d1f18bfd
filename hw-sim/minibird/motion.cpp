#include "hw-sim/minibird/motion.hpp"

#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::hw_sim {

BirdPose Circle::pose(std::size_t bird, double t_s) const {
  const double angle = 2 * std::numbers::pi * t_s / period_s + static_cast<double>(bird) * phase_rad;
  return {rotation_exp({0, 0, angle}), centre_mm + radius_mm * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0)};
}

BirdPose PivotMotion::pose(std::size_t bird, double t_s) const {
  constexpr double kTurn = 2 * std::numbers::pi;
  const double tilt = most_tilt_deg * kRadPerDeg * std::sin(kTurn * t_s / widening_s);
  const double round = kTurn * t_s / round_s;
  const double spin = spin_deg * kRadPerDeg * std::sin(kTurn * t_s / (0.37 * widening_s));
  // The shaft lies along the sensor's x axis: a tilt turns about what is across it.
  const Eigen::Matrix3d rotation =
      rotation_exp({0, tilt * std::cos(round), tilt * std::sin(round)}) * rotation_exp({spin, 0, 0});
  const Eigen::Vector3d beside(0, 60.0 * static_cast<double>(bird), 0);
  return {rotation, pivot_in_tracker_mm + beside - rotation * tip_in_sensor_mm};
}

BirdMotion pivot_motion(const PivotMotion& pivot, std::int64_t zero_ns) {
  return [pivot, zero_ns](std::size_t bird, std::int64_t at_ns) {
    return pivot.pose(bird, static_cast<double>(at_ns - zero_ns) * 1e-9);
  };
}

BirdMotion circle_motion(const Circle& circle, std::int64_t zero_ns) {
  return [circle, zero_ns](std::size_t bird, std::int64_t at_ns) {
    return circle.pose(bird, static_cast<double>(at_ns - zero_ns) * 1e-9);
  };
}

BirdMotion still_motion() {
  return [](std::size_t bird, std::int64_t /*at_ns*/) {
    return BirdPose{Eigen::Matrix3d::Identity(), Eigen::Vector3d(400, 60.0 * static_cast<double>(bird), 0)};
  };
}

BirdMotion motion_named(const std::string& name, double circle_period_s, std::int64_t zero_ns) {
  if (name == "still") return still_motion();
  if (name == "pivot") return pivot_motion({}, zero_ns);
  return circle_motion({.period_s = circle_period_s}, zero_ns);
}

}  // namespace birdseye::hw_sim
