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
// Along an axis with less spread (root mean square) one touch that is off looks like a stretch.
constexpr double kLeastSpread_mm = 10;

struct ScaledFit {
  double scale = 1, squares_mm2 = 0;
  double from_squares_mm2 = 0;  ///< of the distances of `from` from its middle
};

Eigen::Vector3d mean_of(Points points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points) sum += point;
  return sum / static_cast<double>(points.size());
}

/// The rotation of the least-squares fit does not depend on the scale.
ScaledFit fit_scaled(Points to_mm, Points from_mm) {
  ScaledFit out;
  const auto rigid = detail::fit_rigid(to_mm, from_mm);
  if (!rigid) return out;
  const Eigen::Vector3d to_mean = mean_of(to_mm), from_mean = mean_of(from_mm);
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

/// Of the points along an axis, the root mean square distance from their middle.
double spread_mm(Points points, int axis) {
  const double mean_mm = mean_of(points)[axis];
  double squares_mm2 = 0;
  for (const Eigen::Vector3d& point : points) squares_mm2 += (point[axis] - mean_mm) * (point[axis] - mean_mm);
  return std::sqrt(squares_mm2 / static_cast<double>(points.size()));
}

/// Fits `to`, with lengths along one of its axes divided by a scale, by turn and shift of `from`. Turn and shift are
/// found for a scale, then the scale for them, and so on: as no turn is a stretch, a few rounds do.
ScaledFit fit_stretched(Points to_mm, Points from_mm, int axis) {
  constexpr int kRounds = 30;
  ScaledFit out;
  const double to_mean_mm = mean_of(to_mm)[axis];
  std::vector<Eigen::Vector3d> squeezed_mm(to_mm.begin(), to_mm.end());
  double squeeze = 1;
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < to_mm.size(); ++i) squeezed_mm[i][axis] = squeeze * to_mm[i][axis];
    const auto rigid = detail::fit_rigid(squeezed_mm, from_mm);
    if (!rigid) return out;
    const double turned_mean_mm = (rigid->rotation * mean_of(from_mm))[axis];
    double products_mm2 = 0, squares_mm2 = 0;
    out.squares_mm2 = 0;
    for (std::size_t i = 0; i < to_mm.size(); ++i) {
      const Eigen::Vector3d turned_mm = rigid->rotation * from_mm[i];
      const double along_mm = to_mm[i][axis] - to_mean_mm;
      products_mm2 += along_mm * (turned_mm[axis] - turned_mean_mm);
      squares_mm2 += along_mm * along_mm;
      out.squares_mm2 += (squeezed_mm[i] - turned_mm - rigid->translation_mm).squaredNorm();
    }
    if (!(squares_mm2 > 0)) return out;
    squeeze = products_mm2 / squares_mm2;
  }
  out.scale = 1 / squeeze;
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
  const auto chance_of = [&](double sigmas) {
    return localisation_rms_mm ? chi_square_tail(sigmas * sigmas, 1) : f_tail(sigmas * sigmas, 1, dof);
  };
  out.scale_chance = chance_of(off);
  const Points from_better = &better == &mirrored ? Points(mirrored_mm) : from_mm;
  const auto rigid = detail::fit_rigid(to_mm, from_better);
  if (!rigid) return out;
  double rigid_mm2 = 0;
  for (std::size_t i = 0; i < to_mm.size(); ++i)
    rigid_mm2 += (to_mm[i] - rigid->rotation * from_better[i] - rigid->translation_mm).squaredNorm();
  for (int axis = 0; axis < 3; ++axis) {
    if (spread_mm(to_mm, axis) < kLeastSpread_mm) continue;
    const ScaledFit stretched = fit_stretched(to_mm, from_better, axis);
    const double gained_mm2 = rigid_mm2 - stretched.squares_mm2;
    if (!(gained_mm2 > 0) || !(stretched.scale > 0)) continue;
    const double axis_mm2 = localisation_rms_mm ? variance_mm2 : std::max(stretched.squares_mm2 / dof, finest_mm2);
    const double stretch = std::abs(stretched.scale - 1);
    // By how much the squares grow with the scale, the fit itself tells.
    const double sigma = std::hypot(stretch * std::sqrt(axis_mm2 / gained_mm2), kSoundScale);
    const double chance = std::min(1.0, 3 * chance_of(stretch / sigma));
    if (chance >= out.axis_scale_chance) continue;
    out.axis = axis;
    out.axis_scale = stretched.scale;
    out.axis_scale_sigma = sigma;
    out.axis_scale_chance = chance;
  }
  return out;
}

}  // namespace birdseye::calibration
