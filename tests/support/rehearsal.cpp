#include "tests/support/rehearsal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "calibration/camera/camera_calibration.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/board_views.hpp"
#include "tests/support/hand_eye_bench.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye::testing {

namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr double kLook_mm = 100;  // from the camera to the target
constexpr int kSmaller = 4;       // pictures are drawn so many times smaller than they were calibrated at: it is quick

/// Of pictures whose pixels are so many times larger.
CameraModel smaller(CameraModel camera) {
  camera.width_px /= kSmaller;
  camera.height_px /= kSmaller;
  for (double* const px : {&camera.fx_px, &camera.fy_px, &camera.cx_px, &camera.cy_px}) *px /= kSmaller;
  return camera;
}

CameraMatrix smaller(CameraMatrix covariance) {
  covariance.topRows<4>() /= kSmaller;
  covariance.leftCols<4>() /= kSmaller;
  return covariance;
}

/// The scope is calibrated as an engineer does it: lens by a board, hand-eye by stations over it.
calibration::CalibrationRecord calibrated(unsigned seed, const RehearsedNoise& noise, RehearsedTruth& truth) {
  HandEyeBench bench(
      {.stations = 20, .corner_px = 0.2, .position_mm = noise.position_mm, .angle_deg = noise.angle_deg, .seed = seed});
  truth.camera_from_sensor = bench.camera_from_sensor;
  const CameraModel lens = *bench.input.camera;
  truth.lens = smaller(lens);
  BoardScene board;
  board.noise_px = 0.3;
  const auto found_lens = calibration::calibrate_camera(board.views(lens, 15, seed), lens.width_px, lens.height_px);
  if (!found_lens) throw std::runtime_error(found_lens.error().what);
  bench.input.camera = found_lens->camera;
  bench.input.camera_covariance = found_lens->covariance;
  const auto found = calibration::calibrate_hand_eye(bench.input);
  if (!found || !found->solved) throw std::runtime_error("the scope cannot be calibrated");
  calibration::CalibrationRecord record;
  record.scope = "rehearsed";
  const calibration::Provenance provenance{"2026-11-26T09:30:00Z", "birdseye", "15 views", Grade::pass};
  record.lens = calibration::LensEntry{provenance,
                                       smaller(found_lens->camera),
                                       "radial3_tangential2",
                                       smaller(found_lens->covariance),
                                       found_lens->rms_px / kSmaller,
                                       found_lens->rms_px / kSmaller,
                                       std::nullopt};
  record.hand_eye = calibration::HandEyeEntry{provenance,
                                              found->camera_from_sensor,
                                              found->covariance,
                                              found->rms_px / kSmaller,
                                              found->held_out_px / kSmaller,
                                              found->held_out_mm,
                                              std::nullopt};
  // Its camera's latency was measured: to half a millisecond.
  record.latency = calibration::LatencyEntry{provenance, 0, -1, 1, 0};
  return record;
}

}  // namespace

Rehearsal::Rehearsal(unsigned seed, const RehearsedNoise& noise) : noise_(noise), random_(seed) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto drawn = [&](double most) -> Eigen::Vector3d {
    return most * Eigen::Vector3d(uniform(random_), uniform(random_), uniform(random_));
  };
  truth.tracker_from_patient = {rotation_exp(drawn(1)), Eigen::Vector3d(Eigen::Vector3d(300, 20, -40) + drawn(30))};
  // Six markers on the skin round about the organ, in a CT of 100 x 110 x 90 mm that begins at (-20, -20, -20).
  truth.fiducials_mm = {{0, 0, 0}, {60, 5, -5}, {65, 75, 0}, {-5, 70, 20}, {30, 20, 55}, {35, 70, 50}};
  for (Eigen::Vector3d& place : truth.fiducials_mm) place += drawn(4);
  truth.target_mm = Eigen::Vector3d(30, 35, 20) + drawn(8);
  markers_mm = truth.fiducials_mm;
  landmark_mm = truth.target_mm;
  record = calibrated(seed, noise_, truth);
  tracker = {{"model", "miniBIRD 800"}, {"unit_serial", "4711"}};
  camera = {{"card", "Storz"}, {"serial", "A1"}};
  record.tracker = tracker;
  record.camera = camera;
}

Eigen::Vector3d Rehearsal::normal3(double sigma) {
  std::normal_distribution<double> normal(0, sigma);
  return {normal(random_), normal(random_), normal(random_)};
}

Transform<Tracker, Sensor> Rehearsal::noisy(const Transform<Tracker, Sensor>& pose) {
  const Eigen::Matrix3d turned = rotation_exp(normal3(noise_.angle_deg * kRadPerDeg)) * pose.rotation();
  return Transform<Tracker, Sensor>(turned, Eigen::Vector3d(pose.translation() + normal3(noise_.position_mm)));
}

void Rehearsal::tell_instruments() {
  wire::Health health;
  health.state = "ready";
  health.instruments = {{"tracker", "running", "", 0, tracker}, {"camera", "running", "", 0, camera}};
  workflow_->take(health, HostTime{time_ms_ * kMs}, std::nullopt);
}

void Rehearsal::give_record() {
  wire::Calibration calibration;
  // As birdseyed does, which passes on no record of other instruments.
  calibration.why_not = calibration::misfit("tracker", record.tracker, tracker);
  if (calibration.why_not.empty()) calibration.why_not = calibration::misfit("camera", record.camera, camera);
  calibration.in_force = calibration.why_not.empty();
  if (calibration.in_force) calibration.record = calibration::record_text(record);
  workflow_->take(calibration, HostTime{time_ms_ * kMs}, std::nullopt);
}

bool Rehearsal::begin() {
  host::LiveSettings live;
  write_ct_with_markers(scratch_ / "ct", markers_mm);
  live.patient.ct = (scratch_ / "ct").string();
  std::ofstream fiducials(scratch_ / "fiducials.txt");
  for (const Eigen::Vector3d& place : markers_mm)
    fiducials << fmt::format("{} {} {}\n", place.x(), place.y(), place.z());
  fiducials.close();
  live.patient.fiducials = scratch_ / "fiducials.txt";
  live.patient.landmarks = scratch_.file(
      "landmarks.csv", fmt::format("name,x,y,z\ntumour,{},{},{}\n", landmark_mm.x(), landmark_mm.y(), landmark_mm.z()));
  live.tip_in_pointer_mm = Eigen::Vector3d(0, 0, 150);
  live.fiducials = touched.size();
  if (settings) settings(live);
  workflow_ = std::make_unique<host::LiveWorkflow>(live);
  for (int i = 0; i < 2000 && workflow_->view().patient == nullptr && workflow_->view().fault.empty(); ++i) {
    sleep_for(Duration::from_ms(5));
    workflow_->tick();
  }
  workflow_->set_link(true, "connecting");
  tell_instruments();
  workflow_->set_link(true, "connected");
  give_record();
  if (!workflow_->view().note(host::LiveStep::calibrate).done) return false;
  workflow_->go_to(host::LiveStep::fiducials);
  return true;
}

/// One measurement of the tracker, a hundredth of a second after the last: scope and pointer.
void Rehearsal::push_birds() {
  time_ms_ += 10;
  if (!poses_come) return;
  const DeviceTime acquired{time_ms_ * kMs};
  // The pointer stands upright, its sensor above the tip; where another tip is screwed on, the tip is elsewhere.
  const Transform<Tracker, Sensor> pointer(Eigen::Matrix3d::Identity(),
                                           Eigen::Vector3d(tip_in_tracker_mm_ - truth.tip_in_pointer_mm));
  const auto told = [this](const Transform<Tracker, Sensor>& pose) { return truth.told_from_tracker * noisy(pose); };
  if (!poses_repeat) told_scope_ = told(scope_);
  wire::Birds birds;
  birds.acquired = acquired;
  birds.birds = {{scope_name, told_scope_}, {pointer_name, told(pointer)}};
  if (scope_name == "scope") {
    history_.push(acquired, Duration{0}, told_scope_);
  } else {
    history_.push(acquired, Duration{0},
                  birds.birds[1].tracker_from_sensor);  // the first bird is the scope's, by its name
  }
  workflow_->take(birds, HostTime{acquired.ns}, std::nullopt);
}

void Rehearsal::rest_at(const Eigen::Vector3d& in_patient_mm, int samples) {
  const Eigen::Vector3d from_mm = tip_in_tracker_mm_;
  const Eigen::Vector3d to_mm = truth.tracker_from_patient * in_patient_mm;
  for (int i = 1; i <= 30 + samples; ++i) {
    tip_in_tracker_mm_ = from_mm + (to_mm - from_mm) * std::min(1.0, i / 30.0);
    push_birds();
  }
}

bool Rehearsal::register_patient() {
  workflow_->confirm_patient();
  for (std::size_t i = 0; i < touched.size(); ++i) {
    const Eigen::Vector3d beside = i < beside_mm.size() ? beside_mm[i] : Eigen::Vector3d::Zero().eval();
    rest_at(truth.fiducials_mm[touched[i]] + beside + normal3(noise_.touch_mm), 80);
  }
  rest_at({0, 0, 200}, 1);
  const host::OperationView view = workflow_->view();
  if (!view.note(host::LiveStep::fiducials).done || !view.fre_mm) return false;
  workflow_->go_to(host::LiveStep::check);
  return true;
}

bool Rehearsal::check(double most_mm) {
  rest_at(truth.target_mm, 60);
  const auto reading = workflow_->view().check;
  if (!reading || !(reading->distance_mm <= most_mm)) return false;
  workflow_->primary(HostTime{time_ms_ * kMs});
  rest_at({0, 0, 200}, 1);
  return workflow_->view().step == host::LiveStep::run;
}

/// The scope turns about the target, 100 mm from it, as about a port.
Transform<Camera, Patient> Rehearsal::true_view() const {
  const Eigen::Matrix3d turn = rotation_exp(Eigen::Vector3d(
      0.25 * std::sin(0.7 * looked_s_), 0.3 * std::sin(0.5 * looked_s_ + 1), 0.2 * std::sin(0.3 * looked_s_)));
  const Eigen::Vector3d aside(8 * std::sin(0.45 * looked_s_), 6 * std::cos(0.6 * looked_s_),
                              kLook_mm + 10 * std::sin(0.35 * looked_s_));
  return {turn, Eigen::Vector3d(aside - turn * truth.target_mm)};
}

Watched Rehearsal::watch(double seconds) {
  Watched out;
  const std::int64_t began_ms = time_ms_;
  while (time_ms_ - began_ms < static_cast<std::int64_t>(seconds * 1e3)) {
    looked_s_ += 0.01;
    scope_ = truth.tracker_from_patient * true_view().inverse() * truth.camera_from_sensor;
    push_birds();
    if ((time_ms_ - began_ms) % 40 == 0) step_frame(&out, static_cast<double>(time_ms_ - began_ms) * 1e-3);
  }
  return out;
}

void Rehearsal::step_frame(Watched* watched, double since_s) {
  ++watched->frames;
  const Transform<Camera, Patient> view = true_view();
  if (frames_come && !(frames_repeat && frame_)) {
    wire::VideoFrame frame;
    frame.info.sequence = sequence_++;
    const DeviceTime taken{time_ms_ * kMs};
    frame.info.acquired = taken + frame_stamp_off;
    frame.info.acquired_sigma = Duration{100'000};
    frame.info.arrived = taken + frame_delay;
    frame.info.pose = history_.at(frame.info.acquired);
    if (record.latency) frame.info.latency = Duration{0};
    frame.width_px = width_px > 0 ? width_px : truth.lens.width_px;
    frame.height_px = height_px > 0 ? height_px : truth.lens.height_px;
    frame.rgb = std::make_shared<std::vector<std::uint8_t>>(
        static_cast<std::size_t>(3) * static_cast<std::size_t>(frame.width_px * frame.height_px), 90);
    frame_ = frame;
    workflow_->take(frame, HostTime{frame.info.arrived.ns}, host::ClockGap{});
  } else if (frames_come && frame_) {
    workflow_->take(*frame_, HostTime{time_ms_ * kMs + frame_delay.ns}, host::ClockGap{});
  }
  workflow_->tick();
  workflow_->draw();
  const host::ShownPicture shown = workflow_->shown_at(HostTime{time_ms_ * kMs + frame_delay.ns + 10 * kMs});
  if (!shown.overlaid || !shown.reason.empty() || shown.strength < 1) {
    if (!shown.reason.empty() && !std::ranges::count(watched->reasons, shown.reason))
      watched->reasons.push_back(shown.reason);
    return;
  }
  const auto drawn = workflow_->picture().camera_from_patient();
  const auto& budget = workflow_->picture().decision().expected;
  if (!drawn || !budget) return;
  const Eigen::Vector3d moved = organ_motion ? organ_motion(since_s) : Eigen::Vector3d::Zero().eval();
  const Eigen::Vector3d true_mm = view * Eigen::Vector3d(truth.target_mm + moved);
  const Eigen::Vector3d drawn_mm = *drawn * landmark_mm;
  const auto true_px = project(truth.lens, true_mm);
  const auto drawn_px = project(workflow_->picture().setup()->camera(), drawn_mm);
  watched->last_green_s = since_s;
  const double error_mm = true_px && drawn_px ? (*true_px - *drawn_px).norm() / truth.lens.fx_px * true_mm.z() : 1e3;
  watched->green.push_back({since_s, error_mm, budget->radius95_mm()});
}

}  // namespace birdseye::testing
