#include "tests/support/rehearsal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <utility>

#include "calibration/camera/camera_calibration.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/picture/field_edge.hpp"
#include "drivers/system/wait.hpp"
#include "host/files/picture.hpp"
#include "hw-sim/minibird/record_encoder.hpp"
#include "tests/support/board_views.hpp"
#include "tests/support/hand_eye_bench.hpp"
#include "tests/support/small_ct.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::testing {

namespace {

constexpr std::int64_t kNsPerMs = 1'000'000;
constexpr Duration kPoseSigma = Duration{300'000};
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
                                       std::nullopt,
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
  truth.tracker_from_patient = {rotation_exp(drawn(1)), Eigen::Vector3d(Eigen::Vector3d(500, 20, -40) + drawn(30))};
  // Six markers on the skin round about the organ, in a CT of 100 x 110 x 90 mm that begins at (-20, -20, -20).
  truth.fiducials_mm = {{0, 0, 0}, {60, 5, -5}, {65, 75, 0}, {-5, 70, 20}, {30, 20, 55}, {35, 70, 50}};
  for (Eigen::Vector3d& place : truth.fiducials_mm) place += drawn(4);
  truth.target_mm = Eigen::Vector3d(30, 35, 20) + drawn(8);
  markers_mm = truth.fiducials_mm;
  landmark_mm = truth.target_mm;
  record = calibrated(seed, noise_, truth);
  // A field that the sensor holds from side to side, and cuts above and below.
  scene_ = std::make_unique<TexturedScene>(truth.target_mm, 0.46 * truth.lens.width_px / truth.lens.fx_px);
  const auto first = scene_->picture(truth.lens, true_view());
  const auto grey = host::grey_of(RgbView{first, truth.lens.width_px, truth.lens.height_px});
  record.lens->round_field = calibration::find_round_field(GreyView{grey, truth.lens.width_px, truth.lens.height_px});
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
  health.reference = reference_name;
  health.instruments = {{"tracker", "running", "", 0, tracker}, {"camera", "running", "", 0, camera}};
  workflow_->take(health, HostTime{time_ms_ * kNsPerMs}, std::nullopt);
}

void Rehearsal::give_record() {
  wire::Calibration calibration;
  // As birdseyed does, which passes on no record of other instruments.
  calibration.why_not = calibration::misfit("tracker", record.tracker, tracker);
  if (calibration.why_not.empty()) calibration.why_not = calibration::misfit("camera", record.camera, camera);
  calibration.in_force = calibration.why_not.empty();
  if (calibration.in_force) calibration.record = signed_record_text(record);
  if (calibration.in_force && change_record) change_record(calibration.record);
  workflow_->take(calibration, HostTime{time_ms_ * kNsPerMs}, std::nullopt);
}

bool Rehearsal::begin() {
  host::LiveSettings live;
  live.authors = authors();
  write_ct_with_markers(scratch_ / "ct", markers_mm);
  live.patient.ct = (scratch_ / "ct").string();
  std::ofstream fiducials(scratch_ / "fiducials.txt");
  for (const Eigen::Vector3d& place : told_markers_mm.empty() ? markers_mm : told_markers_mm)
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
  look_about();
  return true;
}

void Rehearsal::look_about() {
  constexpr double kLookAbout_s = 8, kHaste = 3;
  look_on(kLookAbout_s, kHaste, nullptr);
}

/// What the driver makes of a bird's record; empty: it withholds it.
std::optional<wire::Bird> Rehearsal::told(const std::string& name, const Transform<Tracker, Sensor>& pose) {
  using namespace drivers::minibird;
  const Transform<Tracker, Sensor> seen = truth.told_from_tracker * noisy(pose);
  const double side = hemisphere_wrong ? -1 : 1;
  BirdLayout layout;
  Record sent;
  sent.words =
      hw_sim::record_words(hw_sim::OutputFormat::position_matrix,
                           {seen.rotation(), Eigen::Vector3d(side * seen.translation())}, layout.mm_per_count * 32768);
  if (name == scope_name) {
    if (poses_repeat && !scope_words_.empty()) sent.words = scope_words_;
    scope_words_ = sent.words;
  }
  auto& guard = guards_.try_emplace(name, layout, Plausibility{}).first->second;
  const BirdReading reading = guard.judge(sent, DeviceTime{time_ms_ * kNsPerMs}, kPoseSigma);
  if (!reading.pose) return std::nullopt;
  return wire::Bird{name, {*reading.pose->rotation, *reading.pose->position_mm}};
}

/// One measurement of the tracker, a hundredth of a second after the last: scope and pointer.
void Rehearsal::push_birds() {
  if (!poses_come) return;
  const DeviceTime acquired{time_ms_ * kNsPerMs};
  // The pointer's sensor is at its upper end; where another tip is screwed on, the tip is elsewhere.
  const Transform<Tracker, Sensor> pointer(
      pointer_turn_, Eigen::Vector3d(tip_in_tracker_mm_ - pointer_turn_ * truth.tip_in_pointer_mm));
  wire::Birds birds;
  birds.acquired = acquired;
  std::vector<std::pair<std::string, Transform<Tracker, Sensor>>> places = {{scope_name, scope_},
                                                                            {pointer_name, pointer}};
  if (!reference_name.empty()) places.emplace_back(reference_name, truth.tracker_from_patient * patient_from_reference);
  for (const auto& [name, place] : places) {
    const auto bird = told(name, place);
    if (!bird) continue;
    birds.birds.push_back(*bird);
    // A frame's pose is that of the bird that is called the scope.
    if (name == "scope") history_.push(acquired, kPoseSigma, bird->tracker_from_sensor);
  }
  workflow_->take(birds, HostTime{acquired.ns}, host::ClockGap{});
}

/// A hundredth of a second goes by; every fourth there is a frame.
void Rehearsal::step(Watched* watched, double since_s) {
  time_ms_ += 10;
  push_birds();
  if (time_ms_ % 40 != 0) return;
  send_frame(since_s);
  workflow_->tick();
  if (watched == nullptr) return;
  ++watched->frames;
  workflow_->draw();
  note_shown(*watched, since_s);
}

void Rehearsal::rest_at(const Eigen::Vector3d& in_patient_mm, int samples) {
  constexpr double kTilt_deg = 20;  // no hand holds a pointer upright
  const Eigen::Vector3d from_mm = tip_in_tracker_mm_;
  const Eigen::Vector3d to_mm = truth.tracker_from_patient * in_patient_mm;
  const Eigen::Matrix3d from_turn = pointer_turn_;
  const Eigen::Vector3d turn = rotation_log(from_turn.transpose() * rotation_exp(normal3(kTilt_deg * kRadPerDeg)));
  for (int i = 1; i <= 60 + samples; ++i) {
    const double share = std::min(1.0, i / 60.0);
    tip_in_tracker_mm_ = from_mm + (to_mm - from_mm) * share;
    pointer_turn_ = from_turn * rotation_exp(Eigen::Vector3d(share * turn));
    step(nullptr, 0);
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

bool Rehearsal::check() {
  rest_at(truth.target_mm, 60);
  workflow_->primary(HostTime{time_ms_ * kNsPerMs});
  if (workflow_->view().fits_at_one) {
    rest_at(truth.fiducials_mm[touched.front()], 60);
    workflow_->primary(HostTime{time_ms_ * kNsPerMs});
  }
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

void Rehearsal::look_on(double seconds, double haste, Watched* watched) {
  const std::int64_t began_ms = time_ms_;
  while (time_ms_ - began_ms < static_cast<std::int64_t>(seconds * 1e3)) {
    looked_s_ += 0.01 * haste;
    scope_ = truth.tracker_from_patient * true_view().inverse() * truth.camera_from_sensor;
    step(watched, static_cast<double>(time_ms_ - began_ms) * 1e-3);
  }
}

void Rehearsal::forget_video() {
  auto scene = std::exchange(scene_, std::make_unique<TexturedScene>(Eigen::Vector3d(1e4, 0, 0)));
  drawn_from_.reset();
  look_on(1, 1, nullptr);
  scene_ = std::move(scene);
  drawn_from_.reset();
}

Watched Rehearsal::watch(double seconds) {
  Watched out;
  look_on(seconds, 1, &out);
  return out;
}

/// What the scope sees of where it truly is.
void Rehearsal::draw_video(double since_s) {
  const Transform<Camera, Patient> view = true_view();
  const Eigen::Matrix4d from = view.matrix();
  const bool moves = organ_motion && since_s > 0;
  if (picture_frozen && drawn_from_) return;
  const bool flips = picture_flipped_x || picture_flipped_y;
  if (drawn_from_ == from && !moves && !flips && drawn_of_ == truth.lens) return;
  drawn_from_ = from;
  drawn_of_ = truth.lens;
  drawn_ = scene_->picture(truth.lens, view, moves ? organ_motion(since_s) : Eigen::Vector3d::Zero().eval());
  if (!flips) return;
  cv::Mat rgb(truth.lens.height_px, truth.lens.width_px, CV_8UC3, drawn_.data());
  cv::flip(rgb.clone(), rgb, picture_flipped_x && picture_flipped_y ? -1 : picture_flipped_x ? 1 : 0);
}

void Rehearsal::send_frame(double since_s) {
  if (frames_come && !(frames_repeat && frame_)) {
    wire::VideoFrame frame;
    frame.info.sequence = sequence_++;
    const DeviceTime taken{time_ms_ * kNsPerMs};
    frame.info.acquired = taken + frame_stamp_off;
    frame.info.acquired_sigma = Duration{100'000};
    frame.info.arrived = taken + frame_delay;
    frame.info.pose = history_.at(frame.info.acquired);
    if (record.latency) frame.info.latency = Duration{0};
    draw_video(since_s);
    frame.width_px = width_px > 0 ? width_px : truth.lens.width_px;
    frame.height_px = height_px > 0 ? height_px : truth.lens.height_px;
    frame.rgb = std::make_shared<std::vector<std::uint8_t>>(
        width_px > 0 ? std::vector<std::uint8_t>(
                           static_cast<std::size_t>(3) * static_cast<std::size_t>(frame.width_px * frame.height_px), 90)
                     : drawn_);
    frame_ = frame;
    workflow_->take(frame, HostTime{frame.info.arrived.ns}, host::ClockGap{});
  } else if (frames_come && frame_) {
    workflow_->take(*frame_, HostTime{time_ms_ * kNsPerMs + frame_delay.ns}, host::ClockGap{});
  }
}

void Rehearsal::note_shown(Watched& watched, double since_s) {
  const host::ShownPicture shown = workflow_->shown_at(HostTime{time_ms_ * kNsPerMs + frame_delay.ns + 10 * kNsPerMs});
  if (!shown.overlaid || !shown.reason.empty() || shown.strength < 1) {
    if (!shown.reason.empty() && !std::ranges::count(watched.reasons, shown.reason))
      watched.reasons.push_back(shown.reason);
    return;
  }
  const auto drawn = workflow_->picture().camera_from_patient();
  const auto& budget = workflow_->picture().decision().expected;
  if (!drawn || !budget) return;
  const Eigen::Vector3d moved = organ_motion ? organ_motion(since_s) : Eigen::Vector3d::Zero().eval();
  const Eigen::Vector3d true_mm = true_view() * Eigen::Vector3d(truth.target_mm + moved);
  const Eigen::Vector3d drawn_mm = *drawn * landmark_mm;
  const auto true_px = project(truth.lens, true_mm);
  const auto drawn_px = project(workflow_->picture().setup()->camera(), drawn_mm);
  watched.last_green_s = since_s;
  const double error_mm = true_px && drawn_px ? (*true_px - *drawn_px).norm() / truth.lens.fx_px * true_mm.z() : 1e3;
  watched.green.push_back({since_s, error_mm, budget->radius95_mm()});
}

}  // namespace birdseye::testing
