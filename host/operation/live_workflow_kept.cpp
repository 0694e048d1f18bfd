// What others have found and wrote: the appliance's record, an earlier window's operation; and what is kept for the
// next.
#include "calibration/record/sha256.hpp"
#include "host/files/record_file.hpp"
#include "host/operation/live_workflow.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

void LiveWorkflow::take(const wire::Calibration& calibration) {
  record_tip_in_pointer_mm_.reset();
  tip_rms_mm_.reset();
  record_doubt_.clear();
  if (!calibration.in_force) {
    if (calibration_.withdraw_record(calibration.why_not)) follow_held_back();
    return;
  }
  const auto admitted = admit_record(calibration.record, settings_.authors);
  if (!admitted) {
    if (calibration_.withdraw_record(admitted.error().what)) follow_held_back();
    return;
  }
  const calibration::CalibrationRecord* const record = &admitted->record;
  record_doubt_ = admitted->doubt;
  record_sha256_ = calibration::sha256_of(calibration::record_text(*record));
  if (record->tip) {
    record_tip_in_pointer_mm_ = record->tip->tip_in_sensor_mm;
    if (!settings_.tip_in_pointer_mm) tip_rms_mm_ = record->tip->rms_mm;
  }
  const auto adopted = calibration_.adopt(*record);
  if (adopted == CalibrationStep::Adopted::no) return;
  if (adopted == CalibrationStep::Adopted::anew) {
    const bool deformed = deformation_.found() != nullptr;
    forget_views(words("note_calibrated_anew"));
    if (deformed) keep();
  }
  follow_held_back();
}

void LiveWorkflow::keep() {
  if (!patient_.plan()) return;
  Operation operation;
  operation.ct_sha256 = patient_.plan()->ct_sha256;
  operation.ct_stated = patient_.plan()->ct_stated;
  operation.labels_sha256 = patient_.plan()->labels_sha256;
  operation.record_sha256 = record_sha256_;
  operation.calibrated = calibration_.rests_on();
  operation.registered = fiducials_.registered_or_held_back();
  if (operation.registered) operation.registered->off = off_.all();
  operation.deformed = deformation_.found();
  // What the next window finds in it rests on the same.
  for (const std::string* doubt : {&record_doubt_, &operation_doubt_, &settings_.recording_doubt, &field_doubt_}) {
    if (operation.doubt.empty()) operation.doubt = *doubt;
  }
  keeper_.keep(std::move(operation));
}

void LiveWorkflow::take_up() {
  const auto operation = keeper_.take_up(patient_.plan()->ct_sha256, patient_.plan()->labels_sha256,
                                         target_in_patient_mm(*patient_.plan()));
  if (!operation) {
    resume_fault_ = operation.error().what;
    return;
  }
  const auto& kept = *operation;
  if (!kept) return;
  operation_doubt_ = kept->doubt;
  landmarks_before_doubt_ = patient_.landmarks().size();
  const std::string when = words("note_taken_up", kept->made_utc);
  if (record_sha256_.empty()) record_sha256_ = kept->record_sha256;
  // The calibration that is in force may be newer, or nobody knows which one it was: a deformation then means nothing.
  const bool same_scope = kept->calibrated && calibration_.take_up(*kept->calibrated, when);
  const bool taken_up = fiducials_.take_up(kept->registered, when);
  // The circle would be too small by what is not known.
  const bool is_known = kept->deformed && kept->deformed->target;
  if (taken_up && same_scope && is_known) {
    deformation_.take_up(kept->deformed, when);
    show_shape();
  } else if (kept->deformed) {
    views_.forget(is_known ? words("note_calibrated_anew") : words("note_deformed_unknown"));
  }
  if (taken_up && kept->registered) off_.take_up(kept->registered->off);
  if (!deformation_.found()) off_.forget_deformed();
  judge_instruments();
  update_setup();
  keep();
  // Patient or transmitter may have been moved meanwhile: only a landmark tells.
  if (fiducials_.confirmed()) return;
  if (return_to_) {
    return_to_ = LiveStep::check;
  } else {
    go_to(LiveStep::check);
  }
}

void LiveWorkflow::tell_unsigned(OperationView& view) const {
  const auto tell = [&view](const std::string& what, const std::string& doubt, LiveStep step) {
    if (doubt.empty()) return;
    if (!view.not_signed.empty()) view.not_signed += ", ";
    view.not_signed += what;
    std::string& line = view.notes[static_cast<std::size_t>(step)].line;
    line = words("note_unsigned", line, doubt);
  };
  tell(words("unsigned_record"), record_doubt_, LiveStep::calibrate);
  tell(words("unsigned_operation"), operation_doubt_, LiveStep::fiducials);
  tell(words("unsigned_recording"), settings_.recording_doubt, LiveStep::connect);
  tell(words("unsigned_field"), field_doubt_, LiveStep::connect);
}

}  // namespace birdseye::host
