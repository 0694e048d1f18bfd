#include "host/operation/live_session.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "host/operation/operation.hpp"
#include "host/registration/rigid/point_matching.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kTipWindow = Duration::from_ms(250);
constexpr std::size_t kFewestFiducials = 3;
constexpr const char* kUnregistered = "the patient is not registered yet";
constexpr const char* kUnconfirmed =
    "the registration was taken up and is not confirmed: point at landmarks in step 6, then press Space";

}  // namespace

const char* name_of(LiveStep step) {
  constexpr std::array<const char*, kLiveSteps> kNames{"connect", "calibrate", "fiducials", "views",
                                                       "deform",  "check",     "run"};
  return kNames[static_cast<std::size_t>(step)];
}

LiveSession::LiveSession(LiveSettings settings) : settings_(std::move(settings)) {
  auto transfer = load_transfer_function(settings_.transfer);
  if (transfer) {
    transfer_ = *std::move(transfer);
  } else {
    fault_ = transfer.error().what;
  }
  if (!settings_.patient.ct.empty()) load(settings_.patient);
}

void LiveSession::tick() {
  if (auto loaded = loading_.take()) finish_loading(*std::move(loaded));
  if (auto found = finding_.take(); found && !markers_in_patient_mm_) {
    markers_in_patient_mm_ = *std::move(found);
    if (!touches_.empty()) fit();
    resume();
  }
  finish_recolouring();
  if (auto found = deforming_.take()) finish_deform(*std::move(found));
  if (guide_) {
    if (auto found = guide_->take()) finish_guide(*std::move(found));
  }
}

void LiveSession::set_link(bool connected, const std::string& words) {
  connected_ = connected;
  link_words_ = words;
  StepNote& note = at(LiveStep::connect);
  if (!connected) {
    health_.reset();
    appliance_says_.clear();
  }
  // What tells nothing of its health, as another server or its recording, is ready when it sends and nothing is said.
  note.done = connected && (health_ ? health_->state == "ready" : picture_.frame() && appliance_says_.empty());
  note.line = words;
  if (connected && health_ && !note.done) note.line = fmt::format("the appliance is {}", health_->state);
  if (connected && !health_ && !appliance_says_.empty()) note.line = appliance_says_;
  if (note.done && step_ == LiveStep::connect) go_to(LiveStep::calibrate);
}

void LiveSession::set_sheet(const calibration::Pattern& pattern, const Eigen::Vector3d& tip_in_pointer_mm,
                            std::size_t fiducials) {
  settings_.pattern = pattern;
  settings_.tip_in_pointer_mm = tip_in_pointer_mm;
  settings_.fiducials = fiducials;
}

void LiveSession::take(const wire::Event& event, HostTime now, const std::optional<ClockGap>& clock) {
  if (const auto* frame = std::get_if<wire::VideoFrame>(&event)) {
    take(*frame, clock ? HostTime{frame->info.acquired.ns + clock->gap.ns} : now);
  } else if (const auto* birds = std::get_if<wire::Birds>(&event)) {
    take(*birds);
  } else if (const auto* health = std::get_if<wire::Health>(&event)) {
    health_ = *health;
  } else if (const auto* status = std::get_if<wire::Status>(&event)) {
    appliance_says_ = status->ok ? "" : status->text;
  } else if (const auto* calibration = std::get_if<wire::Calibration>(&event)) {
    take(*calibration);
  } else if (const auto* pedal = std::get_if<wire::Pedal>(&event)) {
    if (pedal->pressed) primary();
  }
  if (guide_) guide_->push(event);
}

void LiveSession::take(const wire::VideoFrame& frame, HostTime exposed) {
  if (!frozen_) picture_.take(frame, exposed);
}

void LiveSession::take(const wire::Birds& birds) {
  const auto& setup = picture_.setup();
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name == settings_.scope && setup && patient_) {
      jitter_.push(birds.acquired, setup->camera_from_patient(bird.tracker_from_sensor) * target_in_patient_mm());
    }
    if (bird.name != settings_.pointer || !settings_.tip_in_pointer_mm) continue;
    const Eigen::Vector3d tip = bird.tracker_from_sensor * *settings_.tip_in_pointer_mm;
    tips_.emplace_back(birds.acquired, tip);
    while (birds.acquired - tips_.front().first > kTipWindow) tips_.pop_front();
    const auto rested = touch_detector_.push(birds.acquired, tip);
    // The hand need not wait for the arithmetic.
    const bool being_worked_out =
        step_ == LiveStep::calibrate && !unconfirmed_ && guide_ && !guide_->state().collecting;
    if (rested && (step_ == LiveStep::fiducials || being_worked_out)) add_touch(*rested);
  }
}

void LiveSession::take(const wire::Calibration& calibration) {
  if (!calibration.in_force) {
    if (!calibration.why_not.empty()) at(LiveStep::calibrate).line = calibration.why_not;
    return;
  }
  const auto record = calibration::parse_record(calibration.record);
  if (record) adopt(*record);
}

void LiveSession::adopt(const calibration::CalibrationRecord& record) {
  if (record.tip && !settings_.tip_in_pointer_mm) settings_.tip_in_pointer_mm = record.tip->tip_in_sensor_mm;
  if (!record.lens || !record.hand_eye) return;
  if (calibrated_here_ && record.hand_eye->provenance.made_utc <= calibrated_utc_) return;
  calibrated_here_ = false;
  if (camera_ && record.hand_eye->provenance.made_utc != calibrated_utc_)
    forget_deformation("the scope was calibrated anew: keep views again");
  calibrated_utc_ = record.hand_eye->provenance.made_utc;
  camera_ = record.lens->camera;
  camera_from_sensor_ = record.hand_eye->camera_from_sensor;
  known_.camera_rms_px = record.lens->rms_px;
  known_.tracked_rms_px = record.hand_eye->rms_px;
  known_.hand_eye_mm = record.hand_eye->held_out_mm;
  StepNote& note = at(LiveStep::calibrate);
  note.done = true;
  note.line = fmt::format("by the scope's record of {}", record.hand_eye->provenance.made_utc);
  update_setup();
}

void LiveSession::begin_calibration() {
  if (guide_ || !settings_.pattern) return;
  GuidePlan plan;
  plan.bird = settings_.scope;
  plan.pattern = *settings_.pattern;
  if (const auto sound = HandEyeGuide::check(plan); !sound) {
    at(LiveStep::calibrate).line = sound.error().what;
    return;
  }
  calibration_verdict_.reset();
  at(LiveStep::calibrate) = {false, "hold the scope over the board"};
  guide_ = std::make_unique<GuideWorker>(plan);
}

void LiveSession::end_calibration() {
  if (guide_) guide_->end("ended by hand");
}

void LiveSession::finish_guide(Result<GuidedCalibration> found) {
  guide_.reset();
  StepNote& note = at(LiveStep::calibrate);
  if (!found) {
    note.line = found.error().what;
    return;
  }
  calibration_verdict_ = found->verdict;
  if (found->verdict.grade == Grade::fail) {
    note.line = "the verdict is fail; " + (found->verdict.reasons.empty() ? "" : found->verdict.reasons.front());
    return;
  }
  forget_deformation("the scope was calibrated anew: keep views again");
  const calibration::HandEyeResult& hand_eye = found->hand_eye;
  camera_ = *found->stations.input.camera;
  camera_from_sensor_ = hand_eye.camera_from_sensor;
  known_.camera_rms_px = found->stations.lens ? found->stations.lens->rms_px : 0;
  known_.tracked_rms_px = hand_eye.tracked_px;
  known_.hand_eye_mm = hand_eye.held_out_mm;
  calibrated_here_ = true;
  calibrated_utc_ = utc_now();
  note.done = true;
  note.line = fmt::format("{}: {} stations, held-out {:.2f} mm", name_of(found->verdict.grade),
                          found->stations.input.stations.size(), hand_eye.held_out_mm);
  update_setup();
  keep_operation();
  if (step_ != LiveStep::calibrate) return;
  const bool all_touched = settings_.fiducials != 0 && at(LiveStep::fiducials).done;
  go_to(all_touched ? LiveStep::views : LiveStep::fiducials);
}

std::optional<GuideState> LiveSession::guide() const {
  if (!guide_) return std::nullopt;
  return guide_->state();
}

std::vector<std::string> LiveSession::guide_lines() const {
  return guide_ ? guide_->lines() : std::vector<std::string>();
}

void LiveSession::add_touch(const Touch& touch) {
  if (settings_.fiducials != 0 && touches_.size() >= settings_.fiducials) return;
  touches_.push_back({touch.tip_in_tracker_mm, touch.rms_mm, std::nullopt});
  fit();
  keep_operation();
}

void LiveSession::touch() {
  if (step_ != LiveStep::fiducials || tips_.size() < 5) return;
  Touch touch;
  touch.tip_in_tracker_mm.setZero();
  for (const auto& [time, tip] : tips_) touch.tip_in_tracker_mm += tip / static_cast<double>(tips_.size());
  double squares = 0;
  for (const auto& [time, tip] : tips_) squares += (tip - touch.tip_in_tracker_mm).squaredNorm();
  touch.rms_mm = std::sqrt(squares / static_cast<double>(tips_.size()));
  touch.samples = static_cast<int>(tips_.size());
  add_touch(touch);
}

void LiveSession::undo_touch() {
  if (touches_.empty()) return;
  touches_.pop_back();
  fit();
  keep_operation();
}

void LiveSession::fit() {
  StepNote& note = at(LiveStep::fiducials);
  note.done = false;
  unconfirmed_ = false;
  fre_mm_.reset();
  registration_fault_.clear();
  tracker_from_patient_.reset();
  for (TouchedFiducial& touch : touches_) touch.residual_mm.reset();
  note.line = fmt::format("{} touched", touches_.size());
  forget_deformation("the fiducials were touched anew: keep views again");
  if (!markers_in_patient_mm_ || touches_.size() < kFewestFiducials) return update_setup();
  std::vector<Eigen::Vector3d> places;
  places.reserve(touches_.size());
  for (const TouchedFiducial& touch : touches_) places.push_back(touch.tip_in_tracker_mm);
  const auto found = match_and_fit(*markers_in_patient_mm_, places);
  if (!found) {
    registration_fault_ = found.error().what;
    return update_setup();
  }
  fitted_in_patient_mm_.clear();
  for (std::size_t i = 0; i < touches_.size(); ++i) {
    touches_[i].residual_mm = found->fit.residuals_mm[i];
    fitted_in_patient_mm_.push_back((*markers_in_patient_mm_)[found->ct_of_touch[i]]);
  }
  fre_mm_ = found->fit.fre_rms_mm;
  known_.fre_mm = *fre_mm_;
  expect_registration_error();
  tracker_from_patient_ = found->fit.to_from.inverse();
  note.line = fmt::format("{} touched, FRE {:.2f} mm", touches_.size(), *fre_mm_);
  note.done = touches_.size() >= std::max(kFewestFiducials + 1, settings_.fiducials);
  update_setup();
  if (note.done && settings_.fiducials != 0 && step_ == LiveStep::fiducials) go_to(LiveStep::views);
}

void LiveSession::update_setup() {
  jitter_ = {};
  std::optional<Setup> setup;
  picture_.set_without_setup(unconfirmed_ ? kUnconfirmed : kUnregistered);
  if (camera_ && camera_from_sensor_ && tracker_from_patient_ && !unconfirmed_)
    setup = Setup{*camera_, *camera_from_sensor_, *tracker_from_patient_};
  picture_.set_setup(std::move(setup), known_);
}

std::optional<double> LiveSession::fre_mm() const {
  return fre_mm_;
}

void LiveSession::go_to(LiveStep step) {
  step_ = step;
  if (step == LiveStep::calibrate && !note(step).done) begin_calibration();
  if (step == LiveStep::run) at(step) = {true, "the overlay runs"};
}

void LiveSession::go_on() {
  if (step_ == LiveStep::run) return;
  const bool may_be_skipped = step_ == LiveStep::views || step_ == LiveStep::deform || step_ == LiveStep::check;
  if (note(step_).done || (may_be_skipped && !deforming())) {
    if (step_ == LiveStep::check) at(step_).done = true;
    go_to(static_cast<LiveStep>(static_cast<int>(step_) + 1));
  }
}

void LiveSession::primary() {
  switch (step_) {
    case LiveStep::connect:
      break;
    case LiveStep::calibrate:
      if (note(step_).done) return go_on();
      return guide_ ? end_calibration() : begin_calibration();
    case LiveStep::fiducials:
      return note(step_).done ? go_on() : touch();
    case LiveStep::views:
      return note(step_).done ? go_on() : keep_view();
    case LiveStep::deform:
      if (note(step_).done) return go_on();
      return deforming() ? cancel_deform() : begin_deform();
    case LiveStep::check:
      unconfirmed_ = false;
      update_setup();
      return go_on();
    case LiveStep::run:
      return set_frozen(!frozen_);
  }
}

void LiveSession::undo() {
  if (step_ == LiveStep::fiducials) undo_touch();
  if (step_ == LiveStep::views) undo_view();
  if (step_ == LiveStep::deform && deformation_ && !deforming()) undo_deform();
}

std::string LiveSession::primary_words() const {
  switch (step_) {
    case LiveStep::connect:
      return "wait for the appliance";
    case LiveStep::calibrate:
      if (note(step_).done) return "go on";
      return guide_ ? "end with the stations so far" : "begin";
    case LiveStep::fiducials:
      return note(step_).done ? "go on" : "take this point";
    case LiveStep::views:
      return note(step_).done ? "go on" : "keep this view";
    case LiveStep::deform:
      if (note(step_).done) return "go on";
      return deforming() ? "cancel" : "match the CT with the views";
    case LiveStep::check:
      return unconfirmed_ ? "the landmarks fit: go on" : "go on";
    case LiveStep::run:
      return frozen_ ? "let the picture go" : "freeze the picture";
  }
  return {};
}

}  // namespace birdseye::host
