#include "calibration/geometry/lens_fold.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace birdseye {

namespace {

bool folded(const CameraModel& camera, const Eigen::Vector2d& undistorted) {
  Eigen::Matrix2d jacobian;
  distort(camera, undistorted, &jacobian);
  return !(jacobian.determinant() > 0);
}

double fold_along(const CameraModel& camera, const Eigen::Vector2d& direction) {
  constexpr double kStep = 0.01;
  constexpr int kHalvings = 30;
  for (int step = 1; step * kStep <= kWidestTangent; ++step) {
    if (!folded(camera, step * kStep * direction)) continue;
    double inside = (step - 1) * kStep, outside = step * kStep;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = 0.5 * (inside + outside);
      (folded(camera, middle * direction) ? outside : inside) = middle;
    }
    return inside;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace

double fold_radius(const CameraModel& camera) {
  // Without tangential distortion all directions are alike.
  const int directions = camera.p1 == 0 && camera.p2 == 0 ? 1 : 64;
  double nearest = std::numeric_limits<double>::infinity();
  for (int i = 0; i < directions; ++i) {
    const double angle_rad = 2 * std::numbers::pi * i / directions;
    nearest = std::min(nearest, fold_along(camera, {std::cos(angle_rad), std::sin(angle_rad)}));
  }
  return nearest;
}

std::optional<Eigen::Vector2d> project_seen(const CameraModel& camera, const Eigen::Vector3d& p, double fold) {
  std::optional<Eigen::Vector2d> pixel = project(camera, p);
  if (!pixel) return std::nullopt;
  const Eigen::Vector2d n = p.head<2>() / p.z();
  if (n.norm() < fold) return pixel;
  // Beyond the nearest fold, other directions may not have folded yet.
  const std::optional<Eigen::Vector2d> back = undistort(camera, distort(camera, n));
  constexpr double kSame = 1e-6;
  if (!back || (*back - n).norm() > kSame * n.norm()) return std::nullopt;
  return pixel;
}

}  // namespace birdseye
