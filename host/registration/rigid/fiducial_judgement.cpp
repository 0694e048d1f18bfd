#include "host/registration/rigid/fiducial_judgement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/points/point_error.hpp"
#include "calibration/points/point_fit.hpp"
#include "host/registration/rigid/point_matching.hpp"
#include "host/registration/rigid/points_in_ct.hpp"

namespace birdseye::host {

namespace {

// A scale that chance makes in so many sets: marginal below the one, fail below the other.
constexpr double kChanceOfScale = 0.01, kLeastChanceOfScale = 0.001;
// No CT's slices are further apart, or nearer, than their file says by more: what fits only so is in another order.
constexpr double kMostAxisScale = 3;

/// What a fit leaves where the CT's lengths along that axis are so many times too long.
double fre_with_axis_scale(std::span<const Eigen::Vector3d> ct_mm, std::span<const Eigen::Vector3d> touched_mm,
                           int axis, double scale) {
  std::vector<Eigen::Vector3d> squeezed_mm(ct_mm.begin(), ct_mm.end());
  for (Eigen::Vector3d& place : squeezed_mm) place[axis] /= scale;
  const auto fit = calibration::fit_points<Patient, Tracker>(squeezed_mm, touched_mm);
  return fit ? fit->fre_rms_mm : std::numeric_limits<double>::infinity();
}

}  // namespace

FiducialJudgement judge_fiducial_points(std::span<const Eigen::Vector3d> ct_mm,
                                        std::span<const Eigen::Vector3d> touched_mm,
                                        std::optional<double> localisation_rms_mm, const calibration::OddPoints& odd,
                                        const Volume* ct) {
  FiducialJudgement out;
  out.shape = calibration::compare_shapes(ct_mm, touched_mm, localisation_rms_mm);
  const calibration::PointShape& shape = out.shape;
  const bool fits = std::min(shape.fre_rms_mm, shape.mirrored_fre_rms_mm) < kLargestFre_mm;
  out.mirrored = shape.handedness == calibration::Handedness::mirrored && shape.mirrored_fre_rms_mm < kLargestFre_mm;
  out.handedness_open = shape.handedness == calibration::Handedness::cannot_tell && fits && ct_mm.size() > 3;
  // Points of another scale seem odd too: all of them fit with a scale as the sound ones would fit without.
  out.along_axis = shape.axis_scale_chance < shape.scale_chance;
  const bool axis_may_be = std::max(shape.axis_scale, 1 / shape.axis_scale) <= kMostAxisScale;
  out.axis_fre_rms_mm = fre_with_axis_scale(ct_mm, touched_mm, shape.axis, shape.axis_scale);
  // Of slices a fifth too far apart no scale of all axes fits the points, and that of the one axis does.
  const bool axis_fits = out.along_axis && axis_may_be && out.axis_fre_rms_mm < kLargestFre_mm;
  const double scaled_mm = axis_fits ? std::min(out.axis_fre_rms_mm, shape.fre_rms_mm) : shape.fre_rms_mm;
  const bool one_is_off = !odd.named.empty() && odd.fre_without_rms_mm < scaled_mm;
  const double chance = std::min(shape.scale_chance, shape.axis_scale_chance);
  if (chance < kChanceOfScale && (fits || axis_fits) && !one_is_off)
    out.scale = chance < kLeastChanceOfScale ? Grade::fail : Grade::marginal;
  if (ct == nullptr) return out;
  out.outside = points_outside(*ct, ct_mm);
  out.ras = look_like_ras(*ct, ct_mm);
  out.ct_reach = reach_of(*ct);
  return out;
}

std::optional<double> times_over_stated(double fre_rms_mm, std::size_t points, double localisation_rms_mm) {
  // An error that is stated is a round figure: one that is half as large again is not worth a word, and this chance
  // speaks from 1.7 times on of six points, from 1.9 times on of four.
  constexpr double kChance = 0.001;
  if (points < 3) return std::nullopt;
  const auto n = static_cast<double>(points);
  const double freedom = 3 * n - 6;
  const double squares = n * fre_rms_mm * fre_rms_mm / (localisation_rms_mm * localisation_rms_mm / 3);
  if (calibration::chi_square_tail(squares, freedom) > kChance) return std::nullopt;
  return std::sqrt(squares / freedom);
}

std::optional<FiducialJudgement> find_mirrored(std::span<const Eigen::Vector3d> markers_in_patient_mm,
                                               std::span<const Eigen::Vector3d> touched_mm) {
  std::vector<Eigen::Vector3d> mirrored_mm(markers_in_patient_mm.begin(), markers_in_patient_mm.end());
  for (Eigen::Vector3d& marker : mirrored_mm) marker.x() *= -1;
  const auto matched = match_and_fit(mirrored_mm, touched_mm);
  if (!matched) return std::nullopt;
  std::vector<Eigen::Vector3d> ct_mm;
  ct_mm.reserve(touched_mm.size());
  for (const std::size_t marker : matched->ct_of_touch) ct_mm.push_back(markers_in_patient_mm[marker]);
  FiducialJudgement judgement = judge_fiducial_points(ct_mm, touched_mm, std::nullopt, {}, nullptr);
  if (!judgement.mirrored) return std::nullopt;
  return judgement;
}

}  // namespace birdseye::host
