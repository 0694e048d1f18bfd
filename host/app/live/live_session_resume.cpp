// The part of the session that keeps what was found, and takes it up again in another window.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>

#include "host/app/live/live_session.hpp"
#include "host/app/live/operation.hpp"

namespace birdseye::host {

void LiveSession::keep_operation() {
  if (settings_.out.empty() || !patient_) return;
  Operation operation;
  operation.made_utc = fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)));
  operation.ct_checksum = patient_->checksum;
  if (calibrated_here_)
    operation.calibrated = {*camera_, *camera_from_sensor_, known_.camera_rms_px, known_.tracked_rms_px};
  if (tracker_from_patient_ && fre_mm_) operation.registered = {tracker_from_patient_->inverse(), *fre_mm_};
  if (deformation_) operation.deformation = deformation_->field;
  const auto written = write_operation(settings_.out, operation);
  keeping_fault_ = written ? "" : "not kept: " + written.error().what;
}

void LiveSession::resume() {
  const std::filesystem::path folder = std::exchange(settings_.resume, {});
  if (folder.empty()) return;
  auto operation = read_operation(folder);
  if (!operation) {
    fault_ = operation.error().what;
    return;
  }
  if (operation->ct_checksum != patient_->checksum) {
    fault_ = fmt::format("{}: is of another CT; give that CT, or go on without --resume", folder.string());
    return;
  }
  const std::string when = "taken up from " + operation->made_utc;
  if (const auto& found = operation->calibrated) {
    guide_.reset();
    camera_ = found->camera;
    camera_from_sensor_ = found->camera_from_sensor;
    known_.camera_rms_px = found->camera_rms_px;
    known_.tracked_rms_px = found->tracked_rms_px;
    calibrated_here_ = true;
    at(LiveStep::calibrate) = {true, when};
  }
  if (const auto& found = operation->registered) {
    tracker_from_patient_ = found->patient_from_tracker.inverse();
    fre_mm_ = known_.fre_mm = found->fre_mm;
    at(LiveStep::fiducials) = {true, fmt::format("{}, FRE {:.2f} mm", when, found->fre_mm)};
  }
  if (operation->deformation) {
    deformation_.emplace();
    deformation_->field = *std::move(operation->deformation);
    at(LiveStep::deform) = {true, when};
    show_deformation();
  }
  update_setup();
  keep_operation();
  // Patient or transmitter may have been moved meanwhile: only a landmark tells.
  if (operation->registered) go_to(LiveStep::check);
}

}  // namespace birdseye::host
