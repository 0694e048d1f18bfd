#pragma once

#include <Eigen/Core>
#include <span>

#include "calibration/base/result.hpp"

namespace birdseye::calibration {

/// Fiducial localisation error: how far a point is picked and touched from where it is, as the length of the error in
/// space, root mean square, both frames together. Taken to be alike for all points and in all directions.
struct LocalisationError {
  double rms_mm = 0;
  /// The true value lies under this with a probability of 95 %. Equal to rms_mm where the error was given, not
  /// estimated: three points leave three degrees of freedom, and three residuals can be small by chance.
  double upper95_mm = 0;
  int degrees_of_freedom = 0;  ///< of the estimate; 0 where the error was given
};

/// Nobody localises better than this: without it, rounding in made-up points would be told from rounding.
inline constexpr double kFinestLocalisation_mm = 0.1;

/// How many times its estimate an error is at most, with a probability of 95 %, where the estimate rests on residuals
/// of so many degrees of freedom: by their chi-square distribution.
double upper95_over_estimate(double degrees_of_freedom);

/// From the FRE of a rigid fit of so many points: FLE^2 = FRE^2 n / (n - 2) (R. Sibson, 1979), and its upper bound by
/// 3 n - 6 degrees of freedom. points >= 3.
LocalisationError localisation_error_of(double fre_rms_mm, std::size_t points);

/// The error to expect at a target, root mean square, of a registration by points:
///   TRE^2(r) = FLE^2 / n (1 + 1/3 sum_k d_k^2 / f_k^2)
/// with d_k the target's and f_k the points' root mean square distance from the k-th principal axis of the points.
/// Source: J. M. Fitzpatrick, J. B. West, C. R. Maurer, "Predicting error in rigid-body point-based registration",
/// IEEE Trans. Med. Imaging 17(5), 1998, eq. 46.
class TargetError {
 public:
  /// points_mm: at least three, not on a line (fit_points has refused others), in the frame the targets are given in.
  TargetError(std::span<const Eigen::Vector3d> points_mm, double localisation_rms_mm);
  [[nodiscard]] double rms_mm(const Eigen::Vector3d& target_mm) const;
  [[nodiscard]] const Eigen::Vector3d& centroid_mm() const { return centroid_mm_; }  ///< where it is least

 private:
  Eigen::Vector3d centroid_mm_;
  Eigen::Matrix3d axes_;         ///< columns
  Eigen::Vector3d inverse_f2_;   ///< 1 / f_k^2, mm^-2
  double least_square_mm2_ = 0;  ///< FLE^2 / n
};

/// Upper tail of the F distribution: the probability that chance alone gives a ratio at least this large.
double f_tail(double ratio, double numerator_dof, double denominator_dof);
/// Upper tail of the chi-square distribution.
double chi_square_tail(double value, double dof);

}  // namespace birdseye::calibration
