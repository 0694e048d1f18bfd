#include "host/demo/demo_session.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <utility>
#include <variant>

#include "calibration/base/median.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/interrupt.hpp"
#include "drivers/system/wait.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/landmark_check.hpp"

namespace birdseye::host {

namespace {

constexpr int kKeepEvery = 20;  // of the overlaid frames, for the pictures of the report

}  // namespace

Result<PatientPlan> read_with_fiducials(const std::filesystem::path& folder, int fiducials) {
  const PatientFiles files = simulated_patient(folder);
  auto patient = read_patient(files);
  if (!patient) return patient;
  std::vector<Eigen::Vector3d> markers_in_patient_mm = find_fiducials(patient->ct, {});
  if (static_cast<int>(markers_in_patient_mm.size()) < fiducials) {
    return Error{Errc::not_found, fmt::format("{}: {} markers found where there are {}", files.ct.path.string(),
                                              markers_in_patient_mm.size(), fiducials)};
  }
  markers_in_patient_mm.resize(static_cast<std::size_t>(fiducials));
  patient->fiducials_in_patient_mm = std::move(markers_in_patient_mm);
  return patient;
}

std::string DemoSession::stage_at(DeviceTime time) const {
  std::string name;
  for (const CartStage& stage : cart_.stages()) {
    if (stage.begins <= time) name = stage.name;
  }
  return name;
}

Result<void> DemoSession::finish() {
  if (auto ended = end_deforming(); !ended) return ended;
  // Of the middle one: measurements that a busy machine had no time for do not make the tracker a slower one.
  if (!tracker_periods_s_.empty()) figures.tracker_rate_hz = 1 / median_of(std::move(tracker_periods_s_));
  return film_.finish();
}

Result<void> DemoSession::take(const wire::Birds& birds) {
  if (last_measured_) tracker_periods_s_.push_back((birds.acquired - *last_measured_).seconds());
  last_measured_ = birds.acquired;
  const std::string stage = stage_at(birds.acquired);
  if (stage == "calibrate") {
    stations_.push(birds);
    take_stations();
  }
  if (stage == "views" || stage == "look") {
    rests_.push(birds);
    keep_views();
  }
  if (began_to_deform_) {
    waiting_.emplace_back(birds);
  } else {
    take_scope(birds);
  }
  if (stage == "calibrate" || stage == "end") return {};
  const auto touch = pointer_.take(birds, "pointer", cart_.sheet().tip_in_pointer_mm);
  if (touch && stage == "touch") {
    touches_in_tracker_mm_.push_back(touch->tip_in_tracker_mm);
    progress_(fmt::format("touched fiducial {} of {}", touches_in_tracker_mm_.size(), cart_.sheet().fiducials));
  }
  return {};
}

void DemoSession::take_stations() {
  while (auto taken = stations_.take_station()) {
    calibration::HandEyeStation station;
    station.name = taken->view.name;
    station.view = std::move(taken->view);
    station.tracker_from_sensor = taken->tracker_from_sensor;
    seen_.input.stations.push_back(std::move(station));
  }
}

void DemoSession::begin_to_calibrate(const wire::VideoFrame& frame) {
  if (std::exchange(calibrating_begun_, true)) return;
  stations_.finish();
  take_stations();
  seen_.width_px = frame.width_px;
  seen_.height_px = frame.height_px;
  figures.board_frames_left_out = stations_.rests().frames_left_out();
  if (const std::string words = stations_.rests().left_out_words(); !words.empty()) progress_.keep(words);
  figures.board_views = static_cast<int>(seen_.input.stations.size());
  calibrating_.start([seen = std::move(seen_)](const std::stop_token&, const auto&) mutable {
    find_lens(seen);
    return calibrate_guided(std::move(seen));
  });
}

Result<void> DemoSession::end_calibrating_and_register() {
  std::optional<Result<GuidedCalibration>> taken;
  for (const Deadline deadline = Deadline::after(Duration::from_ms(60'000)); !(taken = calibrating_.take());) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
    if (deadline.passed()) return Error{Errc::timeout, "the calibration took over 60 s"};
    sleep_for(Duration::from_ms(5));
  }
  const Result<GuidedCalibration>& calibrated = *taken;
  if (!calibrated) return calibrated.error().with_context("calibration");
  const auto found = calibrated_by_board(*calibrated, utc_now());
  if (!found) {
    return Error{found.error().code, fmt::format("calibration: {}", fmt::join(calibrated->verdict.reasons, "; "))};
  }
  const auto fit = register_by_touches(*patient_->fiducials_in_patient_mm, touches_in_tracker_mm_, &patient_->ct);
  if (!fit) return fit.error().with_context("registration");
  const ScopeSetup& scope = scope_.emplace(found->scope);
  found_with_ = instruments_.now();
  figures.camera_rms_px = calibrated->stations.lens->rms_px;
  figures.held_out_px = calibrated->hand_eye.held_out_px;
  figures.fre_mm = fit->registered.fre_mm;
  figures.fiducial_residuals_mm = fit->residuals_mm;
  setup = scope.registered(fit->registered.tracker_from_patient);
  const auto transfer = load_transfer_function("tumour-and-vessels");
  if (!transfer) return transfer.error();
  auto engine = make_engine("cpu", patient_->shown, *transfer);
  if (!engine) return engine.error();
  engine_ = *std::move(engine);
  look_.render.step_mm = 1.2;
  const Eigen::Vector3d target_mm = target_in_patient_mm(*patient_);
  TrustFigures trust = trust_figures(scope.figures(), fit->registered, target_mm);
  trust.target_in_patient_mm = target_mm;
  painter_.set_setup(std::nullopt, trust);
  judge();
  progress_.keep(fmt::format("camera {:.2f} px from {} views, hand-eye held out {:.2f} px, registration {:.2f} mm",
                             figures.camera_rms_px, figures.board_views, figures.held_out_px, fit->registered.fre_mm));
  return {};
}

void DemoSession::keep_views() {
  while (const auto rest = rests_.take()) {
    // Of a rest the pose is known better than of a frame: the tracker's noise is averaged away.
    if (!setup || began_to_deform_) continue;
    views_.keep(rest->frame, setup->camera_from_patient(rest->tracker_from_sensor), setup);
    progress_(views_.note().line);
  }
}

void DemoSession::begin_to_deform() {
  rests_.finish();
  keep_views();
  began_to_deform_ = host_now();
  progress_.keep(fmt::format("{} views kept; the CT is matched with them", views_.views().size()));
  // All of the organ that the labels name, whatever of it is drawn.
  auto transfer = load_transfer_function("liver");
  if (!transfer) return;
  deformation_.begin(views_.views(), setup->camera(), patient_,
                     std::make_shared<const TransferFunction>(*std::move(transfer)), {}, scope_->camera_covariance());
}

void DemoSession::note_deformed() {
  if (deforming_took_s_ || deformation_.running()) return;
  deformation_.tick();
  deforming_took_s_ = (host_now() - *began_to_deform_).seconds();
}

Result<void> DemoSession::end_deforming() {
  if (!began_to_deform_) return {};
  for (const Deadline deadline = Deadline::after(Duration::from_ms(120'000)); deformation_.running();) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
    if (deadline.passed()) return Error{Errc::timeout, "matching the CT with the views took over 120 s"};
    if (const std::string line = deformation_.progress(); !line.empty()) progress_(line);
    sleep_for(Duration::from_ms(20));
  }
  note_deformed();
  DeformingFigures& said = figures.deforming.emplace();
  said.views = static_cast<int>(views_.views().size());
  said.took_s = *deforming_took_s_;
  said.words = deformation_.note().line;
  said.found = deformed() != nullptr;
  if (deformed() != nullptr) {
    said.surface_expected_mm = deformed()->seen_rms_mm;
    engine_->deform(deformed()->field);
    TrustFigures trust = painter_.figures();
    trust.target_in_patient_mm = as_shown_mm(target_in_patient_mm(*patient_), deformed());
    trust.motion_error = deformed()->target;
    painter_.set_setup(std::nullopt, trust);
    judge();
  }
  progress_.keep(said.words);
  for (const auto& one : waiting_) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
    if (const auto* const frame = std::get_if<wire::VideoFrame>(&one)) {
      if (auto drawn = overlay(*frame); !drawn) return drawn;
    } else if (const auto* const birds = std::get_if<wire::Birds>(&one)) {
      take_scope(*birds);
    } else {
      take(std::get<wire::Health>(one));
    }
  }
  return {};
}

void DemoSession::take_scope(const wire::Birds& birds) {
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name != "scope") continue;
    painter_.take(birds.acquired, bird.tracker_from_sensor);
    video_.take(birds.acquired, bird.tracker_from_sensor);
  }
}

void DemoSession::take(const wire::Health& health) {
  instruments_.take(health);
  if (setup) judge();
}

/// Asks of the frame what the window asks of each: whether video and poses agree, and the round field with the lens.
void DemoSession::watch(const wire::VideoFrame& frame) {
  if (video_.take(frame, *scope_, painter_.target_in_camera_mm(frame)).any()) judge();
}

/// Has the overlay drawn by the setup only as long as what tells of it agrees.
void DemoSession::judge() {
  const InstrumentMatch match = instruments_.match(found_with_, DependsOn::tracker_and_camera);
  TrustFigures trust = painter_.figures();
  video_.enter(trust);
  why_no_setup_ = match.why_not;
  painter_.set_setup(match.holds ? setup : std::nullopt, trust);
}

Result<void> DemoSession::overlay(const wire::VideoFrame& frame) {
  watch(frame);
  const OverlayGate::Decision decision = painter_.decide(frame);
  const auto painted = painter_.paint(frame, decision, *engine_, look_);
  if (painted) {
    if (overlaid.size() % kKeepEvery == 0) {
      kept.push_back({frame.info.sequence,
                      {frame.width_px, frame.height_px, *frame.rgb},
                      std::nullopt,
                      {frame.width_px, frame.height_px, painted->rgb}});
      if (deformed() != nullptr) {
        engine_->undeform();
        if (auto rigid = painter_.paint(frame, decision, *engine_, look_))
          kept.back().rigid = {frame.width_px, frame.height_px, std::move(rigid->rgb)};
        engine_->deform(deformed()->field);
      }
    }
    overlaid.push_back({frame.info.sequence, frame.info.acquired, painted->camera_from_patient});
    if (overlaid.size() % kKeepEvery == 0) progress_(fmt::format("overlaid {} frames", overlaid.size()));
  } else if (overlaid.empty() && video_.motion() == VideoAgreement::untold) {
    ++figures.frames_unproven;
  } else {
    ++figures.frames_without_overlay;
    figures.note_hidden(why_no_setup_.empty() ? decision.reason : why_no_setup_);
  }
  return film_.add(painted ? painted->rgb : *frame.rgb);
}

Result<void> DemoSession::take(const wire::VideoFrame& frame) {
  ++figures.frames;
  // By the camera's own count, whoever lost them.
  if (!first_sequence_) first_sequence_ = frame.info.sequence;
  figures.frames_dropped = static_cast<int>(frame.info.sequence - *first_sequence_ + 1) - figures.frames;
  const std::string stage = stage_at(frame.info.acquired);
  if (stage == "calibrate") {
    stations_.push(frame);
    progress_(fmt::format("calibrating: {} views of the board", seen_.input.stations.size()));
  }
  const bool sees_liver = stage == "views" || stage == "look" || stage == "end";
  if (stage == "touch" || sees_liver) begin_to_calibrate(frame);
  if (!sees_liver) return {};
  if (!setup) {
    if (auto done = end_calibrating_and_register(); !done) return done;
  }
  if (stage == "views") {
    watch(frame);
    rests_.push(frame);
    return {};
  }
  if (!began_to_deform_) {
    const auto stages = cart_.stages();
    const bool viewed = std::any_of(stages.begin(), stages.end(), [](const auto& s) { return s.name == "views"; });
    if (!viewed) return overlay(frame);
    begin_to_deform();
  }
  note_deformed();
  waiting_.emplace_back(frame);
  return {};
}

Result<void> DemoSession::run(EventStream& stream) {
  instruments_.set_link(true);
  constexpr Duration kPatience = Duration::from_ms(15'000);
  HostTime heard = host_now();
  for (;;) {
    if (interrupted()) return Error{Errc::disconnected, "interrupted; nothing is left running"};
    if (const std::string failure = cart_.failure(); !failure.empty()) return Error{Errc::disconnected, failure};
    auto event = stream.next(Deadline::after(Duration::from_ms(200)));
    if (!event) return event.error();
    if (!*event) {
      const auto stages = cart_.stages();
      // Nothing waits, the script has ended, and the last frames have had time to come.
      if (!stages.empty() && stages.back().name == "end" && host_now() - heard > Duration::from_ms(500)) return {};
      if (host_now() - heard > kPatience)
        return Error{Errc::timeout, "the appliance has sent nothing for 15 s; see birdseyed.log"};
      continue;
    }
    Result<void> taken;
    if (const auto* frame = std::get_if<wire::VideoFrame>(&**event)) {
      taken = take(*frame);
      heard = host_now();
    } else if (const auto* health = std::get_if<wire::Health>(&**event)) {
      began_to_deform_ ? void(waiting_.emplace_back(*health)) : take(*health);
    } else if (const auto* birds = std::get_if<wire::Birds>(&**event)) {
      taken = take(*birds);
      // After the script's end the tracker goes on a little; the last frames may still be on their way.
      const auto stages = cart_.stages();
      const bool ended = !stages.empty() && stages.back().name == "end" && stages.back().begins < birds->acquired;
      if (ended && host_now() - heard > Duration::from_ms(400)) return {};
    }
    if (!taken) return taken;
  }
}

}  // namespace birdseye::host
