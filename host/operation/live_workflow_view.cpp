// What the steps know, told as values.
#include "host/operation/live_workflow.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "host/operation/landmark_check.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

/// Views, touched places and a deformation, in words; empty: there are none.
std::string LiveWorkflow::lost_with_registration() const {
  std::vector<std::string> lost;
  if (!views_.views().empty()) lost.push_back(words("lost_views", views_.views().size()));
  if (strokes_.places() > 0) lost.push_back(words("lost_places", strokes_.places()));
  if (deformation_.found()) lost.push_back(words("lost_deformation"));
  if (deformation_.running()) lost.push_back(words("lost_matching"));
  return fmt::format("{}", fmt::join(lost, ", "));
}

/// Only where a press would do nothing: what it would do else, primary() does.
std::string LiveWorkflow::why_primary_refused() const {
  if (frozen_ || asks_for_instruments() || asks_for_patient()) return {};
  std::string no_setup = picture_.why_no_setup();
  switch (step_) {
    case LiveStep::fiducials:
      if (fiducials_.note().done && !fiducials_.begins_anew()) return {};
      if (simulated_) return words("touch_simulated");
      return pointer_held() ? std::string() : words("why_no_pointer");
    case LiveStep::views:
      return views_.note().done ? std::string()
                                : views_.why_refused(picture_.frame(), picture_.seen_from(), picture_.setup());
    case LiveStep::deform:
      if (deformation_.running()) return words("match_runs");
      if (deformation_.note().done && !motion_.moved_mm()) return {};
      if (!no_setup.empty()) return no_setup;
      return DeformationStep::why_too_few(views_.views().size(), strokes_.places() > 0);
    default:
      return {};
  }
}

OperationView LiveWorkflow::view() const {
  OperationView out;
  out.step = step_;
  out.simulated = simulated_;
  out.notes = {
      connection_.note(), calibration_.note(), fiducials_.note(), views_.note(), deformation_.note(), check_, run_};
  tell_unsigned(out);
  out.stroking = strokes_.stroking();
  out.touched_places = strokes_.places();
  out.stroke_line = strokes_.line();
  if (out.touched_places > 0) {
    std::string& line = out.notes[static_cast<std::size_t>(LiveStep::views)].line;
    line += fmt::format("{}{}", line.empty() ? "" : ", ", words("note_places_touched", out.touched_places));
  }
  out.frozen = frozen_;
  out.overlay_hidden = picture_.hidden();
  for (const std::string* fault : {&resume_fault_, &patient_.fault(), &patient_.engine_fault(), &keeper_.fault()}) {
    if (out.fault.empty()) out.fault = *fault;
  }
  out.writing = keeper_.writing();
  if (is_other_patients())
    out.patient_fault = words("patient_wrong", patient_.plan()->identity.id, settings_.patient_id);
  out.asks_for_patient = asks_for_patient();
  out.asks_for_instruments = asks_for_instruments();
  out.link = connection_.link();
  out.has_rod = calibration_.found() && calibration_.found()->scope.has_rod();
  if (out.has_rod) out.rod_angle_deg = settings_.rod_angle_deg;
  out.reference = reference_.name();
  out.board_named = settings_.pattern.has_value();
  out.guiding = calibration_.guiding();
  if (step_ == LiveStep::calibrate) {
    out.guide = calibration_.guide();
    out.guide_lines = calibration_.guide_lines();
    out.calibration_verdict = calibration_.verdict();
  }
  out.fiducials_wanted = settings_.fiducials;
  const auto& markers = patient_.markers_in_patient_mm();
  if (markers) {
    out.markers_seen = markers->size();
    out.markers_in_patient_mm = *markers;
  }
  out.landmarks = patient_.landmarks();
  out.looking_for_marker = picks_.looking();
  out.pick_line = pick_line_;
  out.touches = fiducials_.touches();
  out.fits_poorly = fiducials_.fits_poorly();
  out.odd_touch = fiducials_.odd();
  out.touch_loses = lost_with_registration();
  out.asked_to_take_back = asked_to_take_back_;
  const auto registered = fiducials_.registered();
  if (registered) out.fre_mm = registered->fre_mm;
  out.registration_fault = fiducials_.fault();
  out.unconfirmed = !fiducials_.confirmed();
  out.fits_at_one = fits_at_mm_.has_value();
  out.registration_held_back = fiducials_.held_back() && fiducials_.registered_or_held_back().has_value();
  out.deforming = deformation_.running();
  if (step_ == LiveStep::deform) out.deform_progress = deformation_.progress();
  out.deformed = deformation_.found();
  out.deformed_with_care = deformation_.with_care();
  out.watched = out.deformed != nullptr && watch_.watches();
  out.organ_moved = motion_.moved_mm().has_value();
  out.surface_told = out.watched && motion_.told(heard_);
  out.surface_unchecked = out.watched && motion_.unchecked();
  if (out.deformed) out.surface_check = watch_.watches() ? motion_.line(heard_) : words("note_not_watched");
  out.patient = patient_.plan();
  out.patient_confirmed = patient_confirmed_;
  out.patient_files = patient_.files();
  out.engine_asked = settings_.engine;
  if (patient_.engine()) out.engine_name = patient_.engine()->name();
  out.transfer = patient_.transfer();
  out.drawn_by = patient_.drawn_by();
  out.shapes = shapes_;
  doubt_steps(out);
  out.primary_refused = why_primary_refused();
  if (!out.patient) return out;
  out.check = check_reading();
  out.checked = checked_;
  if (const auto seen_from = picture_.seen_from(); seen_from && step_ == LiveStep::views)
    out.view_advice = views_.advice(*seen_from, target_in_patient_mm(*out.patient));
  out.target = picture_.target();
  out.expected = picture_.decision().expected;
  if (out.deformed && !out.patient->landmarks.empty()) {
    const Eigen::Vector3d at_rest_mm = target_in_patient_mm(*out.patient);
    out.target_moved_mm = (as_shown_mm(at_rest_mm, out.deformed.get()) - at_rest_mm).norm();
  }
  return out;
}

/// Empty where it has not been seen for a moment, also because nothing comes any more.
std::optional<Touch> LiveWorkflow::pointer_held() const {
  return pointer_is_seen() ? pointer_.held() : std::nullopt;
}

bool LiveWorkflow::pointer_is_seen() const {
  return pointer_was_ && heard_ - *pointer_was_ < kPointerIsSeen;
}

/// One that is picked where the tip is shown proves nothing.
std::span<const NamedPoint> LiveWorkflow::landmarks_that_count() const {
  const std::span<const NamedPoint> all = patient_.landmarks();
  const bool doubted = !fiducials_.confirmed() || fiducials_.suspected();
  return doubted ? all.first(std::min(all.size(), landmarks_before_doubt_)) : all;
}

std::optional<CheckReading> LiveWorkflow::check_reading() const {
  const auto tip_mm = pointer_is_seen() ? pointer_.in_tracker_mm() : std::nullopt;
  const auto registered = fiducials_.registered();
  if (!tip_mm || !registered || !patient_.plan()) return std::nullopt;
  const auto& markers = patient_.markers_in_patient_mm();
  return check_by_landmarks(*tip_mm, *registered, landmarks_that_count(),
                            markers ? *markers : registered->fiducials_in_patient_mm, deformation_.found().get());
}

std::optional<ImageRgba> LiveWorkflow::ct_seen_from(const CameraModel& camera,
                                                    const Transform<Camera, Patient>& camera_from_patient,
                                                    const RenderSettings& settings) const {
  if (!patient_.engine()) return std::nullopt;
  return patient_.engine()->render(camera, camera_from_patient, settings);
}

}  // namespace birdseye::host
