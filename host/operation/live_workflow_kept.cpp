// What others have found and wrote: the appliance's record, an earlier window's operation; and what is kept for the
// next.
#include <algorithm>
#include <cstddef>

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
  const bool was_of_this_window = calibration_.is_of_this_window();
  const auto adopted = calibration_.adopt(*record);
  if (adopted == CalibrationStep::Adopted::no) return note_tip();
  if (adopted == CalibrationStep::Adopted::anew) {
    const bool deformed = deformation_.found() != nullptr;
    // As it was read off another scope's rod. Before this window had any it was said of the first to come.
    if (was_of_this_window) settings_.rod_angle_deg.reset();
    forget_views(words("note_calibrated_anew"));
    if (deformed) keep();
  }
  note_tip();
  follow_held_back();
}

/// The fiducials were touched with another tip, so they may lie elsewhere: a person has to look whether the
/// registration holds. Strokes, and what was matched with them, are dropped for the same reason.
void LiveWorkflow::note_tip() {
  const auto& tip_mm = tip_in_pointer_mm();
  // What is held back may come back with the pointer that it was touched with.
  if (fiducials_.held_back() || !tip_mm || !touched_with_mm_ || *tip_mm == *touched_with_mm_) return;
  touched_with_mm_ = tip_mm;
  const bool deformed = deformation_.found() != nullptr;
  forget_views(words("note_views_other_tip"));
  doubt_registration(words("why_other_tip"));
  if (deformed) keep();
}

/// Of the map by which the appliance corrects poses nothing else is told: where one that nobody known signed comes or
/// goes, it is another, and so is the tracker's frame.
void LiveWorkflow::note_field(const std::string& unsigned_why) {
  const bool another = field_told_ && *field_told_ != unsigned_why;
  field_told_ = unsigned_why;
  if (another) doubt_registration(words("why_other_field"));
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
  if (operation.registered) {
    operation.registered->off = off_.all();
    operation.registered->tip_in_pointer_mm = touched_with_mm_;
  }
  operation.deformed = deformation_.found();
  operation.landmarks = picked_landmarks();
  // What the next window finds in it rests on the same.
  for (const std::string* doubt : {&record_doubt_, &operation_doubt_, &settings_.recording_doubt, &field_doubt_}) {
    if (operation.doubt.empty()) operation.doubt = *doubt;
  }
  keeper_.keep(std::move(operation));
}

/// But for those that were picked since the registration came into doubt: the next window would take them for known
/// before it.
std::vector<NamedPoint> LiveWorkflow::picked_landmarks() const {
  const auto known = landmarks_that_count();
  const std::size_t of_plan = std::min(known.size(), patient_.plan()->landmarks.size());
  return {known.begin() + static_cast<std::ptrdiff_t>(of_plan), known.end()};
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
  for (const NamedPoint& landmark : kept->landmarks) patient_.add_landmark(landmark);
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
  if (taken_up && kept->registered) {
    off_.take_up(kept->registered->off);
    touched_with_mm_ = kept->registered->tip_in_pointer_mm;
  }
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
