#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// A rigid fit of corresponding points, and how far to believe it.
template <typename To, typename From>
struct PointFit {
  Transform<To, From> to_from;
  std::vector<double> residuals_mm;  ///< |to_i - to_from * from_i|
  double fre_rms_mm = 0;             ///< fiducial registration error: root mean square of the residuals
  /// For each point, its distance from where the fit of all the others puts it: what a target there would be off by.
  /// Empty where there are only three points, or the others do not determine a fit.
  std::vector<double> leave_one_out_mm;
};

namespace detail {
struct RigidFit {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation_mm;
};
Result<RigidFit> fit_rigid(std::span<const Eigen::Vector3d> to_mm, std::span<const Eigen::Vector3d> from_mm);
}  // namespace detail

/// The rotation and translation that minimise the sum of squared residuals, by the singular value decomposition of the
/// cross-covariance (K. S. Arun et al., 1987, with S. Umeyama's guard against reflections, 1991).
/// Refuses unequal counts, fewer than three points, points on a line (Errc::degenerate) and numbers that are not
/// finite.
template <typename To, typename From>
Result<PointFit<To, From>> fit_points(std::span<const Eigen::Vector3d> to_mm,
                                      std::span<const Eigen::Vector3d> from_mm) {
  const auto fit = detail::fit_rigid(to_mm, from_mm);
  if (!fit) return fit.error();
  PointFit<To, From> out;
  out.to_from = Transform<To, From>(fit->rotation, fit->translation_mm);
  double squares = 0;
  for (std::size_t i = 0; i < to_mm.size(); ++i) {
    out.residuals_mm.push_back((to_mm[i] - out.to_from * from_mm[i]).norm());
    squares += out.residuals_mm.back() * out.residuals_mm.back();
  }
  out.fre_rms_mm = std::sqrt(squares / static_cast<double>(to_mm.size()));
  for (std::size_t left_out = 0; to_mm.size() > 3 && left_out < to_mm.size(); ++left_out) {
    std::vector<Eigen::Vector3d> to(to_mm.begin(), to_mm.end());
    std::vector<Eigen::Vector3d> from(from_mm.begin(), from_mm.end());
    to.erase(to.begin() + static_cast<std::ptrdiff_t>(left_out));
    from.erase(from.begin() + static_cast<std::ptrdiff_t>(left_out));
    const auto others = detail::fit_rigid(to, from);
    if (!others) {
      out.leave_one_out_mm.clear();
      break;
    }
    out.leave_one_out_mm.push_back(
        (to_mm[left_out] - others->rotation * from_mm[left_out] - others->translation_mm).norm());
  }
  return out;
}

}  // namespace birdseye::calibration
