#include "calibration/points/point_shape.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"

namespace birdseye::calibration {

namespace {

using Points = std::span<const Eigen::Vector3d>;

constexpr double kClearOdds = 100;
constexpr double kSoundScale = 0.002;

struct ScaledFit {
  double scale = 1, squares_mm2 = 0;
  double from_squares_mm2 = 0;  ///< of the distances of `from` from its middle
};

/// The rotation of the least-squares fit does not depend on the scale.
ScaledFit fit_scaled(Points to_mm, Points from_mm) {
  ScaledFit out;
  const auto rigid = detail::fit_rigid(to_mm, from_mm);
  if (!rigid) return out;
  const auto n = static_cast<double>(to_mm.size());
  Eigen::Vector3d to_mean = Eigen::Vector3d::Zero(), from_mean = to_mean;
  for (std::size_t i = 0; i < to_mm.size(); ++i) {
    to_mean += to_mm[i] / n;
    from_mean += from_mm[i] / n;
  }
  double products_mm2 = 0;
  for (std::size_t i = 0; i < to_mm.size(); ++i) {
    const Eigen::Vector3d turned = rigid->rotation * (from_mm[i] - from_mean);
    products_mm2 += turned.dot(to_mm[i] - to_mean);
    out.from_squares_mm2 += turned.squaredNorm();
  }
  out.scale = products_mm2 / out.from_squares_mm2;
  for (std::size_t i = 0; i < to_mm.size(); ++i)
    out.squares_mm2 += (to_mm[i] - to_mean - out.scale * (rigid->rotation * (from_mm[i] - from_mean))).squaredNorm();
  return out;
}

}  // namespace

PointShape compare_shapes(Points to_mm, Points from_mm, std::optional<double> localisation_rms_mm) {
  std::vector<Eigen::Vector3d> mirrored_mm(from_mm.begin(), from_mm.end());
  for (Eigen::Vector3d& point : mirrored_mm) point.x() *= -1;
  const ScaledFit as_is = fit_scaled(to_mm, from_mm), mirrored = fit_scaled(to_mm, mirrored_mm);
  const auto n = static_cast<double>(to_mm.size());
  const double dof = 3 * n - 7;
  const double finest_mm2 = kFinestLocalisation_mm * kFinestLocalisation_mm / 3;  // per coordinate
  PointShape out;
  out.fre_rms_mm = std::sqrt(as_is.squares_mm2 / n);
  out.mirrored_fre_rms_mm = std::sqrt(mirrored.squares_mm2 / n);
  const double floor_mm2 = dof * finest_mm2;
  out.mirrored_odds =
      localisation_rms_mm
          ? std::exp(1.5 * (as_is.squares_mm2 - mirrored.squares_mm2) / (*localisation_rms_mm * *localisation_rms_mm))
          : std::pow((as_is.squares_mm2 + floor_mm2) / (mirrored.squares_mm2 + floor_mm2), 0.5 * dof);
  if (!(out.mirrored_odds < 1 / kClearOdds))
    out.handedness = out.mirrored_odds > kClearOdds ? Handedness::mirrored : Handedness::cannot_tell;

  const ScaledFit& better = mirrored.squares_mm2 < as_is.squares_mm2 ? mirrored : as_is;
  const double variance_mm2 = localisation_rms_mm ? *localisation_rms_mm * *localisation_rms_mm / 3
                                                  : std::max(better.squares_mm2 / dof, finest_mm2);
  out.scale = better.scale;
  out.scale_sigma = std::hypot(std::sqrt(variance_mm2 / better.from_squares_mm2), kSoundScale);
  const double off = (out.scale - 1) / out.scale_sigma;
  out.scale_chance = localisation_rms_mm ? chi_square_tail(off * off, 1) : f_tail(off * off, 1, dof);
  return out;
}

}  // namespace birdseye::calibration
