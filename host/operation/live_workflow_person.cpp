// What a person does, by keys and by the pedal.
#include <algorithm>
#include <cmath>
#include <utility>

#include "host/operation/live_workflow.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

void LiveWorkflow::turn_rod(double by_deg) {
  const auto& found = calibration_.found();
  if (!found || !found->scope.has_rod()) return;
  auto& angle_deg = settings_.rod_angle_deg;
  angle_deg = angle_deg ? std::remainder(*angle_deg + by_deg, 360.0) : found->scope.calibrated_at_deg();
  update_setup();
}

void LiveWorkflow::go_to(LiveStep step) {
  asked_to_take_back_.reset();
  if (step != LiveStep::views) strokes_.end();
  // Where it rests by now, as on a landmark, is no touch of this step.
  if (step == LiveStep::fiducials && step_ > LiveStep::fiducials) pointer_ = {};
  step_ = step;
  // What is held back may come back by itself; by the large button the scope is calibrated anew.
  const bool open = !calibration_.note().done && !calibration_.held_back();
  if (step == LiveStep::calibrate && open) calibration_.begin(settings_.scope, settings_.pattern, instruments_.now());
  if (step == LiveStep::run) run_ = {true, words("note_runs")};
}

void LiveWorkflow::go_on() {
  if (step_ == LiveStep::run) return;
  const bool may_be_skipped = step_ == LiveStep::views || step_ == LiveStep::deform || step_ == LiveStep::check;
  if (!view().note(step_).done && (!may_be_skipped || deformation_.running())) return;
  // Nobody has looked yet whether what was taken up holds: that is not to be skipped.
  if (step_ == LiveStep::check && !fiducials_.confirmed()) return;
  if (step_ == LiveStep::check) check_ = {true, checked_ ? check_.line : words("note_unchecked")};
  go_to(static_cast<LiveStep>(static_cast<int>(step_) + 1));
}

void LiveWorkflow::primary(HostTime now) {
  heard_ = now;
  constexpr Duration kSettle = Duration::from_ms(1000);  // a hand that presses twice, a pedal that bounces
  if (frozen_) return freeze_or_let_go();
  if (asks_for_instruments() || asks_for_patient()) {
    asks_for_instruments() ? confirm_instruments() : confirm_patient();
    confirmed_at_ = now;
    return;
  }
  if (confirmed_at_ && now < *confirmed_at_ + kSettle) return;
  const auto& setup = picture_.setup();
  const bool works = step_ == LiveStep::calibrate || step_ == LiveStep::fiducials || step_ == LiveStep::views ||
                     step_ == LiveStep::deform;
  const bool outdated = step_ == LiveStep::deform && motion_.moved_mm();
  const bool anew = step_ == LiveStep::fiducials && fiducials_.begins_anew();
  if (works && !outdated && !anew && view().note(step_).done) return go_on();
  switch (step_) {
    case LiveStep::connect:
      break;
    case LiveStep::calibrate:
      return calibration_.guiding() ? calibration_.end()
                                    : calibration_.begin(settings_.scope, settings_.pattern, instruments_.now());
    case LiveStep::fiducials:
      if (simulated_) break;  // its operator touches them
      if (const auto held = pointer_held()) add_touch(*held);
      break;
    case LiveStep::views:
      return views_.keep(picture_.frame(), picture_.seen_from(), setup);
    case LiveStep::deform:
      if (deformation_.running()) return;  // cancel_matching() is for a key of its own
      if (setup && patient_.plan() && patient_.transfer()) {
        matched_ = {views_.views(), setup->camera(), nullptr, nullptr};
        deformation_.begin(matched_.views, matched_.camera, patient_.plan(), patient_.transfer(),
                           strokes_.touches(tip_shift_mm(tip_rms_mm_, picture_.figures().scope.held_out_mm)),
                           calibration_.found()->scope.camera_covariance());
      }
      break;
    case LiveStep::check:
      return check_registration();
    case LiveStep::run:
      return hide_or_show_overlay();
  }
}

void LiveWorkflow::stroke() {
  if (step_ != LiveStep::views) return;
  if (strokes_.stroking()) return strokes_.end();
  if (!tip_in_pointer_mm()) return strokes_.refuse(words("note_no_tip"));
  if (!fiducials_.registered() || !fiducials_.confirmed()) {
    return strokes_.refuse(words("note_no_stroke", why_unregistered()));
  }
  strokes_.begin(views_.views().size());
}

void LiveWorkflow::take_back(std::size_t touch) {
  if (step_ != LiveStep::fiducials || touch >= fiducials_.touches().size()) return;
  if (asked_to_take_back_ != touch && !lost_with_registration().empty()) {
    asked_to_take_back_ = touch;
    return;
  }
  asked_to_take_back_.reset();
  if (!fiducials_.take_back(touch)) return;
  fit();
  keep();
}

void LiveWorkflow::undo() {
  if (step_ == LiveStep::fiducials && !fiducials_.touches().empty()) take_back(fiducials_.touches().size() - 1);
  if (step_ == LiveStep::views && !strokes_.undo(views_.views().size())) views_.undo();
  // One that speaks against the registration is not to be taken back: only that it fits ends that.
  const bool speaks_against = !patient_.landmarks().empty() && off_.refuses_at(patient_.landmarks().back().place_mm);
  if (step_ == LiveStep::check && !speaks_against && patient_.undo_landmark()) {
    landmarks_before_doubt_ = std::min(landmarks_before_doubt_, patient_.landmarks().size());
    keep();
  }
  if (step_ == LiveStep::deform && deformation_.found() && !deformation_.running()) {
    deformation_.undo();
    show_shape();
    keep();
  }
}

}  // namespace birdseye::host
