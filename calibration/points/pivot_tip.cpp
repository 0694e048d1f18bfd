#include "calibration/points/pivot_tip.hpp"

#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration::pivot {

namespace {

/// A direction that swings less than this, squared, is rounding: the tip along it is left alone.
constexpr double kOpen = 1e-10;

Means means_of(const Poses& poses, const Indices& used, std::size_t divots) {
  Means m{std::vector<Eigen::Matrix3d>(divots, Eigen::Matrix3d::Zero()),
          std::vector<Eigen::Vector3d>(divots, Eigen::Vector3d::Zero()), std::vector<double>(divots, 0)};
  for (const std::size_t i : used) {
    m.rotation[poses[i].divot] += poses[i].tracker_from_sensor.rotation();
    m.translation[poses[i].divot] += poses[i].tracker_from_sensor.translation();
    m.count[poses[i].divot] += 1;
  }
  for (std::size_t k = 0; k < divots; ++k) {
    if (m.count[k] == 0) continue;
    m.rotation[k] /= m.count[k];
    m.translation[k] /= m.count[k];
  }
  return m;
}

}  // namespace

TipEquations solve(const Poses& poses, const Indices& used, std::size_t divots) {
  TipEquations out;
  out.means = means_of(poses, used, divots);
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const std::size_t i : used) {
    const auto& pose = poses[i].tracker_from_sensor;
    const Eigen::Matrix3d swing = pose.rotation() - out.means.rotation[poses[i].divot];
    out.normal += swing.transpose() * swing;
    right -= swing.transpose() * (pose.translation() - out.means.translation[poses[i].divot]);
  }
  const SymmetricEigen<3> eigen = symmetric_eigen(out.normal);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d direction = eigen.vectors.col(k);
    if (eigen.values[k] > kOpen * static_cast<double>(used.size()))
      out.inverse += direction * direction.transpose() / eigen.values[k];
  }
  out.tip = out.inverse * right;
  return out;
}

bool leaves_open(const TipEquations& linear, std::size_t used) {
  return symmetric_eigenvalues(linear.normal)[0] <= kOpen * static_cast<double>(used);
}

Eigen::Vector3d shaft_of(const Eigen::Vector3d& tip_mm) {
  constexpr double kNone_mm = 1e-6;
  return tip_mm.norm() > kNone_mm ? Eigen::Vector3d(tip_mm.normalized()) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

std::vector<int> sides_of(const Poses& poses, const TipEquations& linear) {
  std::vector<int> sides;
  for (const PivotPose& pose : poses) {
    const Eigen::Vector3d mean = (linear.means.rotation[pose.divot] * shaft_of(linear.tip)).normalized();
    const Eigen::Vector3d shaft = pose.tracker_from_sensor.rotation() * shaft_of(linear.tip);
    const Eigen::Vector3d x = mean.unitOrthogonal();
    const double turn = std::atan2(shaft.dot(mean.cross(x)), shaft.dot(x)) / (360 * kRadPerDeg) + 0.5;
    // A pointer that did not lean at all, or has no length, leans to no side: any will do.
    sides.push_back(turn >= 0 && turn < 1 ? static_cast<int>(turn * kSides) : 0);
  }
  return sides;
}

}  // namespace birdseye::calibration::pivot
