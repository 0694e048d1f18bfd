#include "calibration/points/point_error.hpp"

#include <cmath>
#include <unsupported/Eigen/SpecialFunctions>

#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration {

namespace {

/// The value that a chi-square variable stays under with this probability.
double chi_square_quantile(double probability, double dof) {
  double low = 0;
  double high = dof + 20 * std::sqrt(2 * dof);
  // Until no number lies between them.
  for (double middle = 0.5 * high; low < middle && middle < high; middle = 0.5 * (low + high))
    (1 - chi_square_tail(middle, dof) < probability ? low : high) = middle;
  return high;
}

}  // namespace

double f_tail(double ratio, double numerator_dof, double denominator_dof) {
  if (!(ratio > 0)) return 1;
  if (std::isinf(ratio)) return 0;
  const double x = denominator_dof / (denominator_dof + numerator_dof * ratio);
  return Eigen::numext::betainc(0.5 * denominator_dof, 0.5 * numerator_dof, x);
}

double chi_square_tail(double value, double dof) {
  return value > 0 ? Eigen::numext::igammac(0.5 * dof, 0.5 * value) : 1;
}

double upper95_over_estimate(double degrees_of_freedom) {
  constexpr double kChance = 0.05;
  return std::sqrt(degrees_of_freedom / chi_square_quantile(kChance, degrees_of_freedom));
}

LocalisationError localisation_error_of(double fre_rms_mm, std::size_t points) {
  const auto n = static_cast<double>(points);
  const double dof = 3 * n - 6;
  const double rms_mm = fre_rms_mm * std::sqrt(3 * n / dof);
  return {rms_mm, rms_mm * upper95_over_estimate(dof), static_cast<int>(dof)};
}

TargetError::TargetError(std::span<const Eigen::Vector3d> points_mm, double localisation_rms_mm) {
  const auto n = static_cast<double>(points_mm.size());
  centroid_mm_.setZero();
  for (const Eigen::Vector3d& p : points_mm) centroid_mm_ += p / n;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points_mm) scatter += (p - centroid_mm_) * (p - centroid_mm_).transpose() / n;
  const SymmetricEigen<3> scattered = symmetric_eigen(scatter);
  axes_ = scattered.vectors;
  // Along an axis the scatter is its eigenvalue; about it, the sum of the other two.
  inverse_f2_ = (scattered.values.sum() - scattered.values.array()).inverse();
  least_square_mm2_ = localisation_rms_mm * localisation_rms_mm / n;
}

double TargetError::rms_mm(const Eigen::Vector3d& target_mm) const {
  const Eigen::Vector3d along2 = (axes_.transpose() * (target_mm - centroid_mm_)).cwiseAbs2();
  const Eigen::Vector3d d2 = along2.sum() - along2.array();
  return std::sqrt(least_square_mm2_ * (1 + d2.dot(inverse_f2_) / 3));
}

}  // namespace birdseye::calibration
