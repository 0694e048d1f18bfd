#include "host/operation/findings.hpp"

#include "drivers/system/clock.hpp"
#include "host/guide/guided_calibration.hpp"
#include "host/registration/rigid/point_matching.hpp"

namespace birdseye::host {

Result<CalibratedScope> calibrated_by_board(const GuidedCalibration& found, const std::string& made_utc) {
  if (found.verdict.grade == Grade::fail) {
    const std::string why = found.verdict.reasons.empty() ? "" : "; " + found.verdict.reasons.front();
    return Error{Errc::degenerate, "the verdict is fail" + why};
  }
  const auto& lens = found.stations.lens;
  return CalibratedScope{
      ScopeSetup::of_hand_eye(*found.stations.input.camera, lens ? std::optional(lens->rms_px) : std::nullopt,
                              found.hand_eye, lens ? std::optional(lens->covariance) : std::nullopt),
      made_utc, true};
}

Result<TouchFit> register_by_touches(std::span<const Eigen::Vector3d> markers_in_patient_mm,
                                     std::span<const Eigen::Vector3d> touched_in_tracker_mm) {
  const auto found = match_and_fit(markers_in_patient_mm, touched_in_tracker_mm);
  if (!found) return found.error();
  TouchFit out;
  out.registered.tracker_from_patient = found->fit.to_from.inverse();
  out.registered.fre_mm = found->fit.fre_rms_mm;
  out.registered.made_utc = utc_now();
  for (const std::size_t marker : found->ct_of_touch)
    out.registered.fiducials_in_patient_mm.push_back(markers_in_patient_mm[marker]);
  out.residuals_mm = found->fit.residuals_mm;
  return out;
}

TrustFigures trust_figures(const ScopeFigures& scope, const RegisteredPatient& registered,
                           const Eigen::Vector3d& target_in_patient_mm) {
  return {scope, registered.fre_mm,
          registration_error_mm(registered.fre_mm, registered.fiducials_in_patient_mm, target_in_patient_mm)};
}

}  // namespace birdseye::host
