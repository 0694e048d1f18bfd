// The part of the session that keeps what was found, and takes it up again in another window.
#include <fmt/format.h>

#include "host/operation/live_session.hpp"
#include "host/operation/operation.hpp"

namespace birdseye::host {

void LiveSession::keep_operation() {
  if (settings_.out.empty() || !patient_) return;
  if (!settings_.resume.empty()) return;  // what is there has not been read yet
  Operation operation;
  operation.made_utc = utc_now();
  operation.ct_checksum = patient_->checksum;
  if (calibrated_here_)
    operation.calibrated = {*camera_,           *camera_from_sensor_, known_.camera_rms_px, known_.tracked_rms_px,
                            known_.hand_eye_mm, calibrated_utc_};
  if (tracker_from_patient_ && fre_mm_)
    operation.registered = {tracker_from_patient_->inverse(), *fre_mm_, fitted_in_patient_mm_};
  if (deformation_) operation.deformation = {deformation_->field, deformation_->uncertainty_mm};
  const auto written = write_operation(settings_.out, operation);
  keeping_fault_ = written ? "" : "not kept: " + written.error().what;
}

void LiveSession::resume() {
  const std::filesystem::path folder = std::exchange(settings_.resume, {});
  if (folder.empty()) return;
  auto operation = read_operation(folder);
  if (operation && operation->ct_checksum != patient_->checksum) {
    operation = Error{Errc::bad_value,
                      fmt::format("{}: is of another CT; give that CT, or go on without --resume", folder.string())};
  }
  if (!operation) {
    fault_ = operation.error().what;
    settings_.out.clear();  // what is there may yet be needed: nothing is written over it
    return;
  }
  const std::string when = "taken up from " + operation->made_utc;
  // A record that the appliance sent meanwhile may be newer.
  const auto& calibrated = operation->calibrated;
  if (calibrated && calibrated->made_utc > calibrated_utc_) {
    const auto& found = calibrated;
    guide_.reset();
    calibrated_utc_ = found->made_utc;
    camera_ = found->camera;
    camera_from_sensor_ = found->camera_from_sensor;
    known_.camera_rms_px = found->camera_rms_px;
    known_.tracked_rms_px = found->tracked_rms_px;
    known_.hand_eye_mm = found->hand_eye_mm;
    calibrated_here_ = true;
    at(LiveStep::calibrate) = {true, when};
  }
  const bool touched = fre_mm_.has_value();  // anew, while the CT was read; fewer than a registration count for nothing
  if (!touched) touches_.clear();
  if (const auto& found = operation->registered; found && !touched) {
    unconfirmed_ = true;
    tracker_from_patient_ = found->patient_from_tracker.inverse();
    fre_mm_ = known_.fre_mm = found->fre_mm;
    fitted_in_patient_mm_ = found->fiducials_in_patient_mm;
    expect_registration_error();
    at(LiveStep::fiducials) = {true, fmt::format("{}, FRE {:.2f} mm", when, found->fre_mm)};
  }
  if (operation->deformation && !touched) {
    deformation_.emplace();
    deformation_->field = operation->deformation->field;
    deformation_->uncertainty_mm = operation->deformation->uncertainty_mm;
    at(LiveStep::deform) = {true, when};
    show_deformation();
  }
  update_setup();
  keep_operation();
  // Patient or transmitter may have been moved meanwhile: only a landmark tells.
  if (unconfirmed_) go_to(LiveStep::check);
}

}  // namespace birdseye::host
