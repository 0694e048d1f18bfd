#include "hw-sim/minibird/field_distortion.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kGridMm = 25;
constexpr int kSteps = 24;  // from the volume's low corner to its high one, along each axis
const Eigen::Vector3d kLowMm(100, -300, -300), kHighMm(700, 300, 300);

}  // namespace

FieldDistortion::FieldDistortion(double peak_mm, std::uint64_t seed) {
  std::uint64_t draw = 0;
  const auto uniform = [&](double low, double high) { return low + (high - low) * hashed_uniform(seed + 101, draw++); };
  for (Bump& bump : bumps_) {
    for (int axis = 0; axis < 3; ++axis) bump.centre_mm[axis] = uniform(kLowMm[axis], kHighMm[axis]);
    Eigen::Vector3d direction;
    for (int axis = 0; axis < 3; ++axis) direction[axis] = hashed_normal(seed + 102, draw++);
    bump.amplitude_mm = uniform(0.5, 1) * direction.normalized();
    bump.width_mm = uniform(120, 240);
  }
  double largest = 0;
  for (int x = 0; x <= kSteps; ++x) {
    for (int y = 0; y <= kSteps; ++y) {
      for (int z = 0; z <= kSteps; ++z) {
        largest = std::max(largest, displacement_mm(kLowMm + kGridMm * Eigen::Vector3d(x, y, z)).norm());
      }
    }
  }
  for (Bump& bump : bumps_) bump.amplitude_mm *= peak_mm / largest;
}

Eigen::Vector3d FieldDistortion::displacement_mm(const Eigen::Vector3d& position_mm) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Bump& bump : bumps_) {
    const double squares = (position_mm - bump.centre_mm).squaredNorm();
    sum += std::exp(-squares / (2 * bump.width_mm * bump.width_mm)) * bump.amplitude_mm;
  }
  return sum;
}

Eigen::Vector3d FieldDistortion::rotation_rad(const Eigen::Vector3d& position_mm) const {
  Eigen::Vector3d curl = Eigen::Vector3d::Zero();
  for (const Bump& bump : bumps_) {
    const Eigen::Vector3d from = position_mm - bump.centre_mm;
    const double variance = bump.width_mm * bump.width_mm;
    curl += std::exp(-from.squaredNorm() / (2 * variance)) / variance * bump.amplitude_mm.cross(from);
  }
  return 0.5 * curl;
}

BirdPose FieldDistortion::apply(const BirdPose& pose, double strength) const {
  return {rotation_exp(strength * rotation_rad(pose.position_mm)) * pose.rotation,
          pose.position_mm + strength * displacement_mm(pose.position_mm)};
}

}  // namespace birdseye::hw_sim
