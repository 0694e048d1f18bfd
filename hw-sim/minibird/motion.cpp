#include "hw-sim/minibird/motion.hpp"

#include <cmath>

#include "calibration/geometry/transform.hpp"

namespace birdseye::hw_sim {

BirdPose Circle::pose(std::size_t bird, double t_s) const {
  const double angle = 2 * std::numbers::pi * t_s / period_s + static_cast<double>(bird) * phase_rad;
  return {rotation_exp({0, 0, angle}), centre_mm + radius_mm * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0)};
}

Motion circle_motion(const Circle& circle, std::int64_t zero_ns) {
  return [circle, zero_ns](std::size_t bird, std::int64_t at_ns) {
    return circle.pose(bird, static_cast<double>(at_ns - zero_ns) * 1e-9);
  };
}

Motion still_motion() {
  return [](std::size_t bird, std::int64_t /*at_ns*/) {
    return BirdPose{Eigen::Matrix3d::Identity(), Eigen::Vector3d(400, 60.0 * static_cast<double>(bird), 0)};
  };
}

}  // namespace birdseye::hw_sim
