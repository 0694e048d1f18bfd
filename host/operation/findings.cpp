#include "host/operation/findings.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "drivers/system/clock.hpp"
#include "host/guide/guided_calibration.hpp"
#include "host/operation/step_states.hpp"
#include "host/registration/rigid/fiducial_judgement.hpp"
#include "host/registration/rigid/point_matching.hpp"
#include "host/registration/rigid/points_in_ct.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

std::string mirrored_words(const calibration::PointShape& shape) {
  return words("fiducials_mirrored", shape.mirrored_fre_rms_mm, shape.fre_rms_mm);
}

std::string axis_words(int axis) {
  return axis == 0 ? words("axis_x") : axis == 1 ? words("axis_y") : words("axis_z");
}

std::string scale_words(const FiducialJudgement& judged) {
  const calibration::PointShape& shape = judged.shape;
  return judged.along_axis ? words("fiducials_scale_axis", axis_words(shape.axis), shape.axis_scale)
                           : words("fiducials_scale", shape.scale);
}

}  // namespace

Result<CalibratedScope> calibrated_by_board(const GuidedCalibration& found, const std::string& made_utc) {
  if (found.verdict.grade == Grade::fail) {
    const auto& why = found.verdict.reasons;
    return Error{Errc::degenerate,
                 why.empty() ? words("note_verdict_fail") : words("note_verdict_fail_why", why.front())};
  }
  const auto& lens = found.stations.lens;
  return CalibratedScope{
      ScopeSetup::of_hand_eye(*found.stations.input.camera, lens ? std::optional(lens->rms_px) : std::nullopt,
                              found.hand_eye, lens ? std::optional(lens->covariance) : std::nullopt)
          .with_round_field(found.stations.round_field),
      made_utc, true};
}

Result<TouchFit> register_by_touches(std::span<const Eigen::Vector3d> markers_in_patient_mm,
                                     std::span<const Eigen::Vector3d> touched_in_tracker_mm, const Volume* ct) {
  const auto found = match_and_fit(markers_in_patient_mm, touched_in_tracker_mm);
  if (!found || found->fit.fre_rms_mm > kGoodFit_mm) {
    const auto mirrored = find_mirrored(markers_in_patient_mm, touched_in_tracker_mm);
    if (mirrored) return Error{Errc::unsupported, mirrored_words(mirrored->shape)};
  }
  if (!found) return found.error();
  TouchFit out;
  out.registered.tracker_from_patient = found->fit.to_from.inverse();
  out.registered.fre_mm = found->fit.fre_rms_mm;
  out.registered.made_utc = utc_now();
  auto& fiducials = out.registered.fiducials_in_patient_mm;
  for (const std::size_t marker : found->ct_of_touch) fiducials.push_back(markers_in_patient_mm[marker]);
  out.residuals_mm = found->fit.residuals_mm;
  const auto odd = calibration::find_odd_points(fiducials, touched_in_tracker_mm);
  const auto judged = judge_fiducial_points(fiducials, touched_in_tracker_mm, std::nullopt, odd, nullptr);
  if (judged.mirrored) return Error{Errc::unsupported, mirrored_words(judged.shape)};
  if (judged.scale == Grade::fail) return Error{Errc::unsupported, scale_words(judged)};
  if (judged.scale == Grade::marginal) out.doubt = scale_words(judged);
  if (judged.handedness_open) out.doubt = words("fiducials_flat");
  if (ct == nullptr) return out;
  if (auto inside = check_places(fiducials, *ct); !inside) return inside.error();
  return out;
}

Result<void> check_places(std::span<const Eigen::Vector3d> fiducials_in_patient_mm, const Volume& ct) {
  const auto outside = points_outside(ct, fiducials_in_patient_mm);
  if (outside.empty()) return {};
  std::vector<std::string> places;
  places.reserve(outside.size());
  for (const std::size_t i : outside) {
    const Eigen::Vector3d& mm = fiducials_in_patient_mm[i];
    places.push_back(words("fiducial_place", mm.x(), mm.y(), mm.z()));
  }
  const std::string why =
      look_like_ras(ct, fiducials_in_patient_mm) ? words("fiducials_ras") : words("fiducials_other", reach_of(ct));
  return Error{Errc::unsupported, words("fiducials_outside", fmt::format("{}", fmt::join(places, ", ")), why)};
}

TrustFigures trust_figures(const ScopeFigures& scope, const RegisteredPatient& registered,
                           const Eigen::Vector3d& target_in_patient_mm) {
  return {scope, registered.fre_mm,
          registration_error_mm(registered.fre_mm, registered.fiducials_in_patient_mm, target_in_patient_mm)};
}

}  // namespace birdseye::host
