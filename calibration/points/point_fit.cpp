#include "calibration/points/point_fit.hpp"

#include <fmt/format.h>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration::detail {

namespace {

/// Points within a thousandth of their extent of one line do not fix the turn about it.
constexpr double kThinnest = 1e-3;

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

bool on_a_line(std::span<const Eigen::Vector3d> points, const Eigen::Vector3d& mean) {
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d values = symmetric_eigenvalues(scatter);
  return !(values[1] > kThinnest * kThinnest * values[2]);
}

}  // namespace

Result<RigidFit> fit_rigid(std::span<const Eigen::Vector3d> to_mm, std::span<const Eigen::Vector3d> from_mm) {
  if (to_mm.size() != from_mm.size()) {
    return Error{Errc::bad_value, fmt::format("{} points against {}: give both files the same points in the same order",
                                              to_mm.size(), from_mm.size())};
  }
  if (to_mm.size() < 3) {
    return Error{Errc::degenerate,
                 fmt::format("{} points: a rigid fit needs at least three, not on a line", to_mm.size())};
  }
  for (std::size_t i = 0; i < to_mm.size(); ++i) {
    if (!to_mm[i].allFinite() || !from_mm[i].allFinite()) {
      return Error{Errc::bad_value, fmt::format("point {} has a coordinate that is not a finite number", i + 1)};
    }
  }
  const Eigen::Vector3d to_mean = mean_of(to_mm);
  const Eigen::Vector3d from_mean = mean_of(from_mm);
  if (on_a_line(to_mm, to_mean) || on_a_line(from_mm, from_mean)) {
    return Error{Errc::degenerate, "the points lie on a line, which leaves the turn about it open: add one beside it"};
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < to_mm.size(); ++i) {
    covariance += (to_mm[i] - to_mean) * (from_mm[i] - from_mean).transpose();
  }
  RigidFit fit;
  fit.rotation = nearest_rotation(covariance);
  fit.translation_mm = to_mean - fit.rotation * from_mean;
  return fit;
}

}  // namespace birdseye::calibration::detail
