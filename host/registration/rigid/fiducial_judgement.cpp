#include "host/registration/rigid/fiducial_judgement.hpp"

#include <algorithm>

#include "host/registration/rigid/point_matching.hpp"
#include "host/registration/rigid/points_in_ct.hpp"

namespace birdseye::host {

namespace {

// A scale that chance makes in so many sets: marginal below the one, fail below the other.
constexpr double kChanceOfScale = 0.01, kLeastChanceOfScale = 0.001;

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
  const bool one_is_off = !odd.named.empty() && odd.fre_without_rms_mm < shape.fre_rms_mm;
  out.along_axis = shape.axis_scale_chance < shape.scale_chance;
  const double chance = std::min(shape.scale_chance, shape.axis_scale_chance);
  if (chance < kChanceOfScale && fits && !one_is_off)
    out.scale = chance < kLeastChanceOfScale ? Grade::fail : Grade::marginal;
  if (ct == nullptr) return out;
  out.outside = points_outside(*ct, ct_mm);
  out.ras = look_like_ras(*ct, ct_mm);
  out.ct_reach = reach_of(*ct);
  return out;
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
