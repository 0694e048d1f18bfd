#include "calibration/points/spin_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "calibration/base/counted.hpp"
#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration {

namespace {

using Rotations = std::vector<Eigen::Matrix3d>;
using Indices = std::vector<std::size_t>;

constexpr std::size_t kLeastSpinPoses = 4;

struct SpunAxis {
  Eigen::Vector3d in_sensor, in_tracker;
  Eigen::Vector3d eigenvalues;  ///< of the mean squared swing, least first
};

SpunAxis solve(const Rotations& rotations, const Indices& used) {
  Eigen::Matrix3d mean = Eigen::Matrix3d::Zero(), swings = Eigen::Matrix3d::Zero();
  for (const std::size_t i : used) mean += rotations[i];
  mean /= static_cast<double>(used.size());
  for (const std::size_t i : used) swings += (rotations[i] - mean).transpose() * (rotations[i] - mean);
  const auto eigen = symmetric_eigen(Eigen::Matrix3d(swings / static_cast<double>(used.size())));
  const Eigen::Vector3d axis = eigen.vectors.col(0);
  return {axis, (mean * axis).normalized(), eigen.values.cwiseMax(0)};
}

std::vector<double> residuals_of(const Rotations& rotations, const SpunAxis& axis) {
  std::vector<double> out;
  for (const Eigen::Matrix3d& r : rotations)
    out.push_back(std::asin(std::min(1.0, (r * axis.in_sensor).cross(axis.in_tracker).norm())) * kDegPerRad);
  return out;
}

/// Which poses agree: within 2.5 deviations of a normal distribution, 2.97 in two dimensions, whose median length is
/// 1.18 deviations.
Indices inliers_of(const std::vector<double>& residuals_deg) {
  std::vector<double> sorted = residuals_deg;
  std::sort(sorted.begin(), sorted.end());
  constexpr double kRounding_deg = 1e-6;
  const double limit = 2.97 * sorted[sorted.size() / 2] / 1.18 + kRounding_deg;
  Indices inliers;
  for (std::size_t i = 0; i < residuals_deg.size(); ++i) {
    if (residuals_deg[i] <= limit) inliers.push_back(i);
  }
  return inliers;
}

double turned_deg(const Rotations& rotations, const Indices& used, const SpunAxis& axis) {
  const Eigen::Vector3d across = axis.in_sensor.unitOrthogonal();
  const Eigen::Vector3d x = axis.in_tracker.unitOrthogonal(), y = axis.in_tracker.cross(x);
  std::vector<double> turns;
  for (const std::size_t i : used) {
    const Eigen::Vector3d seen = rotations[i] * across;
    turns.push_back(std::atan2(seen.dot(y), seen.dot(x)) * kDegPerRad);
  }
  std::sort(turns.begin(), turns.end());
  double gap = turns.front() + 360 - turns.back();
  for (std::size_t i = 1; i < turns.size(); ++i) gap = std::max(gap, turns[i] - turns[i - 1]);
  return 360 - gap;
}

}  // namespace

Result<SpinAxis> solve_spin_axis(std::span<const Transform<Tracker, Sensor>> tracker_from_sensor,
                                 const Eigen::Vector3d& towards) {
  if (tracker_from_sensor.size() < kLeastSpinPoses) {
    return Error{Errc::degenerate, fmt::format("{} of the spun pointer: its axis needs at least {}",
                                               counted(tracker_from_sensor.size(), "pose", "poses"), kLeastSpinPoses)};
  }
  Rotations rotations;
  for (const auto& pose : tracker_from_sensor) {
    if (!pose.rotation().allFinite())
      return Error{Errc::bad_value, fmt::format("pose {} has a number that is not finite", rotations.size() + 1)};
    rotations.push_back(pose.rotation());
  }
  Indices used(rotations.size());
  std::iota(used.begin(), used.end(), std::size_t{0});
  SpunAxis axis = solve(rotations, used);
  for (int round = 0; round < 20; ++round) {
    Indices inliers = inliers_of(residuals_of(rotations, axis));
    if (inliers == used || inliers.size() < kLeastSpinPoses) break;
    used = std::move(inliers);
    axis = solve(rotations, used);
  }
  if (axis.in_sensor.dot(towards) < 0) {
    axis.in_sensor = -axis.in_sensor;
    axis.in_tracker = -axis.in_tracker;
  }
  SpinAxis out;
  out.axis_in_sensor = axis.in_sensor;
  out.residuals_deg = residuals_of(rotations, axis);
  const auto count = static_cast<double>(used.size());
  double squares = 0;
  for (const std::size_t i : used) squares += out.residuals_deg[i] * out.residuals_deg[i];
  out.wobble_deg = std::sqrt(squares / count);
  // Two coordinates a pose, four unknowns: where the axis points in the sensor and in the room.
  const double variance_deg2 = squares / std::max(1.0, 2 * count - 4);
  out.sigma_deg = std::sqrt(variance_deg2 / (count * std::max(1e-12, axis.eigenvalues[1])));
  out.turned_deg = turned_deg(rotations, used, axis);
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    if (!std::binary_search(used.begin(), used.end(), i)) out.outliers.push_back(i);
  }
  return out;
}

}  // namespace birdseye::calibration
