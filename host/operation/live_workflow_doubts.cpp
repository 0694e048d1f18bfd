// What speaks against what was found, and the landmark that a person checks it by.
#include <algorithm>
#include <cmath>
#include <utility>

#include "host/operation/landmark_check.hpp"
#include "host/operation/live_workflow.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

// What is off by more is not drawn by, whatever the figures say: the gate's limit of the target's expected error.
constexpr double kMostCheckedOff_mm = OverlayGate::Settings().most_target_mm;

// Whoever was away from the patient for so long does not know what was moved meanwhile. A scope that was away as the
// patient was touched has longer to come.
constexpr Duration kPause = Duration::from_ms(10'000), kToBringScope = Duration::from_ms(60'000);

}  // namespace

/// Why there is no overlay by what the fiducials give.
std::string LiveWorkflow::why_unregistered() const {
  if (fiducials_.held_back()) return words("why_registration_held", fiducials_.note().line);
  if (fiducials_.confirmed()) return words("why_unregistered");
  return why_doubted_.empty() ? words("why_unconfirmed") : why_doubted_;
}

/// The reference does not tell any more where the patient is: only a landmark does.
void LiveWorkflow::take(ReferenceSensor::News news) {
  if (news == ReferenceSensor::News::none) return;
  doubt_registration(news == ReferenceSensor::News::moved ? words("why_reference_moved", reference_.name())
                                                          : words("why_reference_lost", reference_.name()));
}

/// Patient or transmitter may have been moved while nobody saw it: only a landmark tells. A reference sees it, and says
/// so where it was lost meanwhile.
void LiveWorkflow::note_pause(HostTime now, std::optional<HostTime>& came, bool counts) {
  const bool paused = came && now - *came > kPause;
  came = now;
  if (paused && counts && !reference_.in_use()) doubt_registration("");
}

/// Somebody has just seen where the patient lies: how long the scope was away before counts no more.
void LiveWorkflow::note_looked_at() {
  scope_away_since_ = heard_ + (kToBringScope - kPause);
}

/// CLOCK_MONOTONIC stands still in a machine that sleeps, and so no pause is seen.
void LiveWorkflow::note_sleep(Duration asleep) {
  constexpr Duration kSlept = Duration::from_ms(1000);  // the two clocks are not read at once
  const bool slept = asleep_ && asleep - *asleep_ > kSlept;
  if (slept || !asleep_) asleep_ = asleep;
  if (slept) doubt_registration("");
}

/// Something begins to speak against the registration: those that are known now may tell whether it holds.
void LiveWorkflow::note_landmarks() {
  if (fiducials_.confirmed() && !fiducials_.suspected()) landmarks_before_doubt_ = patient_.landmarks().size();
}

void LiveWorkflow::doubt_registration(const std::string& why) {
  if (!fiducials_.registered_or_held_back() && fiducials_.touches().empty()) return;
  why_doubted_ = why;
  note_landmarks();
  fiducials_.doubt();
  pointer_ = {};  // where it was before tells nothing of what has moved since
  fits_at_mm_.reset();
  strokes_.end();
  forget_views_of_before();
  if (!fiducials_.registered_or_held_back()) return follow_held_back();
  run_ = {};
  checked_.reset();
  check_ = {false, why};
  (return_to_ ? *return_to_ : step_) = LiveStep::check;
  update_setup();
}

/// Those of before would be matched with later ones as if nothing had moved between them, also where two landmarks fit
/// to some millimetres. A deformation by views of one setup is checked by these landmarks, and stays.
void LiveWorkflow::forget_views_of_before() {
  if (views_.views().empty() && strokes_.places() == 0) return;
  views_.forget(words("note_views_doubted"));
  strokes_.forget();
}

/// The newest frame, if it is time for another check. Of a motion that is known the check goes on: it may pass.
void LiveWorkflow::watch_surface(HostTime now) {
  const auto seen_from = picture_.seen_from();
  if (!seen_from) return;
  std::optional<double> pose_mm;
  if (const auto& hand_eye_mm = picture_.figures().scope.held_out_mm) {
    // Of a pose, each axis: its position's error, or where its angles' too have the target, which the jitter counts.
    const double one_mm = std::max(picture_.frame()->info.pose.position_sigma_mm,
                                   picture_.jitter().rms_mm().value_or(0) / std::sqrt(3.0));
    pose_mm = std::hypot(*hand_eye_mm, std::sqrt(2.0) * one_mm);  // this view's, and that of a kept one
  }
  watch_.offer({*picture_.frame(), *seen_from}, pose_mm, now);
}

void LiveWorkflow::watch_motion(const wire::VideoFrame& frame) {
  const bool guided = calibration_.guiding();
  if (std::exchange(guided_, guided) != guided) update_setup();
  // Over the board nothing is watched: its squares look alike, one after the other.
  const auto scope = guided ? std::nullopt : scope_as_it_is();
  if (!scope) return video_.look_away(frame.info.acquired);
  note_pause(heard_, watched_, settings_.video_must_agree);
  const VideoWatch::News news = video_.take(frame, *scope, picture_.target_in_camera_mm(frame));
  if (news.field) update_setup();
  if (!settings_.video_must_agree) return;
  // What has moved was the scope on its sensor, or patient or transmitter: of these only a landmark tells.
  if (news.contradicted) doubt_registration(words("why_video_differs"));
  if (news.again) forget_views_of_before();
  // To ask at each picture would let nobody register. Once they agree it tells whether it is done since.
  if (news.again && !fiducials_.suspected()) {
    note_landmarks();
    fiducials_.suspect();
    if (fiducials_.suspected()) pointer_ = {};
    fits_at_mm_.reset();
  }
  if (news.motion && video_.motion() == VideoAgreement::agrees && fiducials_.suspected()) doubt_registration("");
  if (news.motion) update_setup();
}

void LiveWorkflow::take(const CheckedSurface& checked) {
  if (!deformation_.found() || !motion_.take(checked)) return;
  const std::string why = motion_.moved_mm() ? words("note_views_organ_moved") : words("note_views_organ_back");
  deformation_.drop(why);
  views_.forget(why);
  strokes_.forget();
  update_setup();
}

/// A step that was done once may not look done while something speaks against what it found, or against what it was
/// found by.
void LiveWorkflow::doubt_steps(OperationView& out) const {
  const auto doubt = [&out](LiveStep step, const std::string& why) {
    StepNote& note = out.notes[static_cast<std::size_t>(step)];
    if (note.done && note.doubt.empty()) note.doubt = why;
  };
  if (const auto& health = out.link.health) {
    for (const wire::InstrumentHealth& one : health->instruments)
      if (one.state != "running") doubt(LiveStep::connect, words("instrument", one.name, one.state));
  }
  std::string why;  // what speaks against a step, and so against those that build on it
  if (calibration_.held_back()) {
    why = words("why_calibration_held", calibration_.note().line);
  } else if (settings_.video_must_agree && video_.motion() == VideoAgreement::differs) {
    why = words("why_video_differs");
  }
  doubt(LiveStep::calibrate, why);
  if (why.empty() && (fiducials_.held_back() || !fiducials_.confirmed())) why = why_unregistered();
  if (why.empty() && fiducials_.registered() && fiducials_.fits_poorly()) why = words("doubt_fit");
  doubt(LiveStep::fiducials, why);
  doubt(LiveStep::views, why);
  if (motion_.moved_mm()) doubt(LiveStep::deform, words("why_moved", *motion_.moved_mm()));
  doubt(LiveStep::deform, why.empty() && deformation_.with_care() ? deformation_.note().line : why);
  doubt(LiveStep::check, why);
  if (motion_.moved_mm()) doubt(LiveStep::check, words("why_moved", *motion_.moved_mm()));
  doubt(LiveStep::run, picture_.setup() ? picture_.decision().reason : picture_.why_no_setup());
}

void LiveWorkflow::check_registration() {
  auto reading = check_reading();
  if (reading && reading->nearest.empty()) reading.reset();
  if (fiducials_.confirmed() && !fiducials_.suspected()) return check_undoubted(reading);
  if (reading) return check_in_doubt(*reading);
  check_ = {false, words("note_check_no_pointer")};
}

/// Nothing speaks against it: only a place that is off does from now on. That a fiducial fits, which it was fitted to,
/// tells nothing of how good it is, and a landmark need not be pointed at.
void LiveWorkflow::check_undoubted(const std::optional<CheckReading>& reading) {
  constexpr double kPointedAt_mm = 100;  // further away the pointer is laid aside
  const bool pointed_at = reading && reading->distance_mm <= kPointedAt_mm;
  if (pointed_at && reading->distance_mm > kMostCheckedOff_mm) return refuse_registration(*reading);
  if (pointed_at) note_off(*reading, false);
  if (pointed_at && !reading->fitted) return confirm_registration(*reading);
  if (!checked_) check_.line = words("note_unchecked");
  confirm_registration(std::nullopt);
}

/// Two places that fit confirm it, or nothing does: what has moved may have another place where the one was. A fitted
/// place tells as much of that as another, and the farther the pointer is from any the more may have moved. But a
/// landmark that was off tells how good the fit is, of which no place tells that it was made to fit: only that landmark
/// overrules itself.
void LiveWorkflow::check_in_doubt(const CheckReading& reading) {
  constexpr double kApart_mm = 30;  // the two places
  if (reading.distance_mm > kMostCheckedOff_mm) return refuse_registration(reading);
  note_off(reading, false);
  if (const PlaceOff* const against = off_.refusing()) {
    if (!fits_at_mm_) fits_at_mm_ = reading.nearest_mm;
    check_ = {false, words("note_check_refused", reading.distance_mm, reading.nearest, against->name)};
    return;
  }
  if (fits_at_mm_ && (*fits_at_mm_ - reading.nearest_mm).norm() >= kApart_mm) return confirm_registration(reading);
  if (!reading.fitted) checked_ = {reading.nearest, reading.distance_mm};
  if (!fits_at_mm_) fits_at_mm_ = reading.nearest_mm;
  check_ = {false, words("note_check_second", reading.distance_mm, reading.nearest)};
}

void LiveWorkflow::note_off(const CheckReading& reading, bool refuses) {
  off_.note({reading.nearest_mm, reading.nearest, reading.distance_mm, deformation_.found() != nullptr, refuses});
  keep();
}

/// A landmark that is off says nothing of what has moved between the kept views: these stay until it is touched anew.
void LiveWorkflow::refuse_registration(const CheckReading& by) {
  why_doubted_ = words("note_check_off", by.distance_mm, by.nearest);
  check_ = {false, why_doubted_};
  checked_.reset();
  fits_at_mm_.reset();
  constexpr double kMeant_mm = 30;  // further away it may not have been pointed at
  if (!by.fitted && by.distance_mm <= kMeant_mm) note_off(by, true);
  note_landmarks();
  fiducials_.doubt();
  update_setup();
}

/// by: where the pointer was; none: check_ says what there is to say.
void LiveWorkflow::confirm_registration(const std::optional<CheckReading>& by) {
  if (by && !by->fitted) checked_ = {by->nearest, by->distance_mm};
  check_ = {true, by ? words("note_checked", by->distance_mm, by->nearest) : check_.line};
  fiducials_.confirm();
  fits_at_mm_.reset();
  why_doubted_.clear();
  if (by) note_looked_at();
  if (by) touched_with_mm_ = tip_in_pointer_mm();
  update_setup();
  keep();  // landmarks that were picked in doubt count from now on
  go_to(LiveStep::run);
}

}  // namespace birdseye::host
