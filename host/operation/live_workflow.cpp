#include "host/operation/live_workflow.hpp"

#include <algorithm>
#include <cmath>

#include "host/operation/landmark_check.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

LiveWorkflow::LiveWorkflow(LiveSettings settings)
    : settings_(std::move(settings)),
      patient_(settings_.transfer, settings_.engine, settings_.make_engine),
      keeper_(settings_.out, settings_.resume, settings_.authors) {
  use_reference(settings_.reference);
  if (!settings_.patient.ct.path.empty()) load(settings_.patient);
}

void LiveWorkflow::tick() {
  note_sleep(time_asleep());
  keeper_.tick();
  const PatientStep::News news = patient_.tick();
  if (news.engine) {
    picture_.set_engine(nullptr);
    if (patient_.engine() && deformation_.found()) patient_.engine()->deform(deformation_.found()->field);
    picture_.set_engine(patient_.engine());
    show_margins();
  }
  if (news.patient) {
    ++shapes_;
    resume_fault_.clear();
    pick_line_.clear();
    const std::string& id = patient_.plan()->identity.id;
    patient_confirmed_ = settings_.patient_id.empty() ? simulated_ : settings_.patient_id == id;
    fit();
    // What was touched meanwhile counts more than what is taken up, and is fitted first.
    if (fiducials_.touches().empty() || (patient_.markers_in_patient_mm() && patient_confirmed_)) take_up();
  }
  if (news.markers) {
    if (!fiducials_.touches().empty()) fit();
    if (fiducials_.touches().empty() || patient_confirmed_) take_up();
  }
  if (const auto picked = picks_.tick()) take(*picked);
  if (deformation_.tick()) {
    show_shape();
    matched_.organ = deformation_.organ();
    matched_.deformed = deformation_.found();
    const std::size_t adjusted = std::min(deformation_.adjusted().size(), matched_.views.size());
    for (std::size_t n = 0; n < adjusted; ++n) matched_.views[n].camera_from_patient = deformation_.adjusted()[n];
    watch_.show(matched_);
    keep();
  }
  if (const auto checked = watch_.tick()) take(*checked);
  if (!calibration_.tick(instruments_.now())) return;
  forget_views(words("note_calibrated_anew"));
  update_setup();
  judge_instruments();
  keep();
  if (step_ != LiveStep::calibrate || !calibration_.found()) return;
  const bool all_touched = settings_.fiducials != 0 && fiducials_.fits();
  go_to(all_touched ? LiveStep::views : LiveStep::fiducials);
}

void LiveWorkflow::set_link(bool connected, const std::string& words, bool may_retry) {
  if (connected != instruments_.connected()) {
    instruments_.set_link(connected);
    // Behind another connection may stand another appliance: it has to send its record first.
    if (!connected && calibration_.withdraw_record(host::words("held_no_link"))) follow_held_back();
    if (!connected) record_tip_in_pointer_mm_.reset();
    if (!connected) reference_.lose();
    if (!connected) first_heard_.reset();
    if (!connected) pointer_ = {};
    judge_instruments();
  }
  connection_.set_link(connected, words, picture_.frame().has_value(), may_retry);
  if (connection_.note().done && step_ == LiveStep::connect) go_to(LiveStep::calibrate);
}

void LiveWorkflow::set_sheet(const calibration::Pattern& pattern, const Eigen::Vector3d& tip_in_pointer_mm,
                             std::size_t fiducials) {
  simulated_ = true;
  settings_.pattern = pattern;
  settings_.tip_in_pointer_mm = tip_in_pointer_mm;
  settings_.fiducials = fiducials;
}

void LiveWorkflow::take(const wire::Event& event, HostTime now, const std::optional<ClockGap>& clock) {
  heard_ = now;
  if (!first_heard_) first_heard_ = now;
  if (reference_.in_use()) {
    const ReferenceSensor::Relative relative = reference_.take(event);
    take(relative.news);
    take_relative(relative.event, now, clock);
  } else {
    take_relative(event, now, clock);
  }
  // Over the board the scope is calibrated in the tracker's frame: a reference may not lie on the patient yet.
  calibration_.push(event);
}

void LiveWorkflow::use_reference(const std::string& name) {
  // What the former one saw it does not tell any more, nor this one what was before.
  if (name != reference_.name()) {
    video_.forget_motion();
    doubt_registration("");
  }
  reference_.use(name, settings_.scope);
  instruments_.set_reference(name);
}

void LiveWorkflow::take_relative(const wire::Event& event, HostTime now, const std::optional<ClockGap>& clock) {
  if (const auto* frame = std::get_if<wire::VideoFrame>(&event)) {
    note_pause(now, video_came_, true);
    watch_motion(*frame);
    if (!frozen_) {
      std::optional<RelatedTime<HostTime>> stamped;
      if (clock) stamped = {clock->host_from_device(frame->info.acquired), clock->host.sigma};
      picture_.take(*frame, exposure_of(stamped, frame->info.acquired_sigma, now));
      const auto& scope = calibration_.found();
      taken_with_ = {instruments_.now().tracker, instruments_.now().camera, scope ? scope->scope_name : ""};
      watch_surface(now);
    }
  } else if (const auto* birds = std::get_if<wire::Birds>(&event)) {
    take_birds(*birds, now, clock);
  } else if (const auto* health = std::get_if<wire::Health>(&event)) {
    connection_.take(*health);
    instruments_.take(*health);
    if (!health->field_unsigned.empty()) field_doubt_ = health->field_unsigned;
    if (settings_.reference.empty()) use_reference(health->reference);
    judge_instruments();
    if (!fiducials_.held_back()) note_field(health->field_unsigned);
  } else if (const auto* status = std::get_if<wire::Status>(&event)) {
    connection_.take(*status);
  } else if (const auto* calibration = std::get_if<wire::Calibration>(&event)) {
    take(*calibration);
  } else if (const auto* pedal = std::get_if<wire::Pedal>(&event)) {
    if (pedal->pressed) primary(now);
  }
}

void LiveWorkflow::take_birds(const wire::Birds& birds, HostTime now, const std::optional<ClockGap>& clock) {
  const auto& setup = picture_.setup();
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name != settings_.scope) continue;
    note_pause(now, scope_away_since_, fiducials_.registered_or_held_back().has_value());
    views_.take(birds.acquired, bird.tracker_from_sensor);
    video_.take(birds.acquired, bird.tracker_from_sensor);
    if (!setup || !patient_.plan()) continue;
    views_.average(*setup);
    picture_.take(birds.acquired, bird.tracker_from_sensor);
  }
  const auto& tip_mm = tip_in_pointer_mm();
  if (!tip_mm) return;
  // What comes late over a slow network tells where the pointer was, which may be before a step began.
  const auto was = clock ? std::optional(clock->host_from_device(birds.acquired) - Duration{2 * clock->host.sigma.ns})
                         : std::nullopt;
  if (!was || now - *was > kPointerIsSeen) {
    pointer_ = {};
    return;
  }
  const auto rested = pointer_.take(birds, settings_.pointer, *tip_mm);
  for (const wire::Bird& bird : birds.birds)
    if (bird.name == settings_.pointer) pointer_was_ = std::min(*was, now);
  const auto registered = fiducials_.registered();
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name != settings_.pointer || !strokes_.stroking() || !registered || !fiducials_.confirmed()) continue;
    strokes_.take(birds.acquired, registered->tracker_from_patient.inverse() * (bird.tracker_from_sensor * *tip_mm));
  }
  // The hand need not wait for the arithmetic.
  const bool touching = step_ == LiveStep::fiducials ||
                        (step_ == LiveStep::calibrate && !fiducials_.begins_anew() && calibration_.working_out());
  // A touch drops a registration that is held back, and the reference that it waits for would then drop the touch.
  if (rested && touching && !may_hear_of_reference() && !is_other_patients()) add_touch(*rested);
}

void LiveWorkflow::add_touch(const Touch& touch) {
  if (!fiducials_.add(touch, settings_.fiducials, instruments_.now())) return;
  touched_with_mm_ = tip_in_pointer_mm();
  // Of touches by another tracker than the former this one's map is no other map.
  if (const auto& health = connection_.link().health) field_told_ = health->field_unsigned;
  note_looked_at();
  fit();
  keep();
}

bool LiveWorkflow::may_hear_of_reference() const {
  constexpr Duration kWithin = Duration::from_ms(2000);  // an appliance tells how it is once a second
  return fiducials_.held_back() && !connection_.link().health && first_heard_ && heard_ - *first_heard_ < kWithin;
}

/// What is found holds with the instruments that are connected now, or is held back.
void LiveWorkflow::judge_instruments() {
  const bool scope = calibration_.judge(instruments_), patient = fiducials_.judge(instruments_);
  if (scope || patient) follow_held_back();
  note_tip();
  if (!fiducials_.fit_is_due()) return;
  fit();
  keep();
}

/// The first step of which something is held back is open again; with all of it back the operation goes on where it
/// was.
void LiveWorkflow::follow_held_back() {
  strokes_.end();
  const bool held_back = calibration_.held_back() || fiducials_.held_back();
  if (held_back) {
    if (!return_to_) return_to_ = step_;
    step_ = !instruments_.connected()  ? LiveStep::connect
            : calibration_.held_back() ? LiveStep::calibrate
                                       : LiveStep::fiducials;
  } else if (return_to_) {
    step_ = *std::exchange(return_to_, std::nullopt);
  }
  update_setup();
}

bool LiveWorkflow::asks_for_instruments() const {
  return connection_.note().done && (calibration_.person_may_say() || fiducials_.person_may_say());
}

void LiveWorkflow::confirm_instruments() {
  instruments_.vouch();
  judge_instruments();
}

void LiveWorkflow::fit() {
  const auto before = fiducials_.registered_or_held_back();
  // Nothing is registered with a CT of which nobody has said whose it is.
  if (patient_confirmed_ || !patient_.plan()) {
    fiducials_.fit(patient_.markers_in_patient_mm(), settings_.fiducials,
                   patient_.plan() ? &patient_.plan()->ct : nullptr);
  } else {
    fiducials_.fit(std::nullopt, settings_.fiducials, nullptr);
  }
  const auto& registered = fiducials_.registered_or_held_back();
  const bool same =
      before && registered && before->tracker_from_patient.matrix() == registered->tracker_from_patient.matrix();
  if (!same) {
    // While the registration is in doubt a fit is of the same touches, less some: a landmark that was off still counts.
    if (fiducials_.confirmed()) {
      off_.forget();
    } else {
      off_.forget_but_refusing();
    }
    fits_at_mm_.reset();
  }
  asked_to_take_back_.reset();
  if (fiducials_.confirmed()) why_doubted_.clear();
  forget_views(words("note_views_touched_anew"));
  update_setup();
  if (fiducials_.fits() && settings_.fiducials != 0 && step_ == LiveStep::fiducials) go_to(LiveStep::views);
}

/// Views are of the poses that they were kept with, touches are where the former registration had them, and a
/// deformation takes in what that was off by: another setup's is no better than none.
void LiveWorkflow::forget_views(const std::string& why) {
  check_ = run_ = {};  // they were of the setup that is no more
  checked_.reset();
  const bool touched = strokes_.stroking() || strokes_.places() > 0;
  if (views_.views().empty() && !touched && !deformation_.found() && !deformation_.running()) return;
  views_.forget(why);
  strokes_.forget();
  if (deformation_.forget()) show_shape();
}

void LiveWorkflow::show_shape() {
  checked_.reset();
  off_.forget_deformed();
  fits_at_mm_.reset();
  ++shapes_;
  watch_.forget();
  motion_ = {};
  update_setup();
  if (!patient_.engine()) return;
  if (deformation_.found()) {
    patient_.engine()->deform(deformation_.found()->field);
  } else {
    patient_.engine()->undeform();
  }
  show_margins();
}

/// As the CT is shown. Has the picture drawn anew.
void LiveWorkflow::show_margins() {
  std::shared_ptr<const Margins> shown;
  if (patient_.plan() && patient_.plan()->margins) {
    const Margins& margins = *patient_.plan()->margins;
    const auto& found = deformation_.found();
    shown = std::make_shared<const Margins>(found ? deformed(margins, found->field) : margins);
  }
  picture_.set_margins(std::move(shown));
}

void LiveWorkflow::update_setup() {
  const auto& scope = calibration_.found();
  const auto registered = fiducials_.registered();
  const bool may = scope && registered && patient_.plan() && fiducials_.confirmed();
  if (patient_.plan() && !patient_confirmed_)
    return picture_.set_setup(std::nullopt, {},
                              is_other_patients() ? words("patient_other") : words("patient_unconfirmed"));
  if (calibration_.held_back())
    return picture_.set_setup(std::nullopt, {}, words("why_calibration_held", calibration_.note().line));
  if (calibration_.guiding()) return picture_.set_setup(std::nullopt, {}, words("why_calibrating"));
  if (!may) return picture_.set_setup(std::nullopt, {}, why_unregistered());
  const ScopeSetup turned = *scope_as_it_is();
  TrustFigures figures = trust_figures(turned.figures(), *registered, target_in_patient_mm(*patient_.plan()));
  const DeformedOrgan* const deformed = deformation_.found().get();
  figures.target_in_patient_mm = as_shown_mm(target_in_patient_mm(*patient_.plan()), deformed);
  if (deformed != nullptr) figures.motion_error = deformed->target;
  // Where it was seen to be off by more than is to be expected, the circle is as large as that.
  if (const auto off_mm = off_.most_mm(deformed != nullptr); off_mm && figures.target_mm)
    figures.target_mm = std::max(*figures.target_mm, *off_mm);
  figures.moved_mm = motion_.moved_mm();
  video_.enter(figures);
  if (!settings_.video_must_agree) figures.video.reset();
  picture_.set_setup(turned.registered(registered->tracker_from_patient), figures);
}

std::optional<ScopeSetup> LiveWorkflow::scope_as_it_is() const {
  const auto& found = calibration_.found();
  if (!found) return std::nullopt;
  return settings_.rod_angle_deg ? found->scope.turned_to(*settings_.rod_angle_deg) : found->scope;
}

}  // namespace birdseye::host
