#include "hw-sim/operation/operation_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "calibration/base/units.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/geometry/rod.hpp"
#include "calibration/geometry/rotations.hpp"
#include "hw-sim/base/hashed.hpp"
#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/phantom/body.hpp"
#include "hw-sim/world/between.hpp"
#include "hw-sim/world/ease.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr double kLook_mm = 100;     // from the camera to the target
constexpr double kHurryAhead_s = 6;  // of its way that the scope goes more in a hurry
constexpr std::size_t kHurriesRemembered = 8;

/// Numbers that follow from a seed, one after the other.
class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : seed_(seed) {}
  Vector3d within(double most) {
    const auto one = [&] { return most * (2 * hashed_uniform(seed_, key_++) - 1); };
    const double x = one(), y = one(), z = one();
    return {x, y, z};
  }
  Vector3d normal(double sigma) {
    const auto one = [&] { return sigma * hashed_normal(seed_, key_++); };
    const double x = one(), y = one(), z = one();
    return {x, y, z};
  }

 private:
  std::uint64_t seed_, key_ = 0;
};

std::string serial_of(std::uint64_t seed) {
  return fmt::format("{:08x}", hashed_word(seed, std::uint64_t{1} << 32) >> 32);
}

}  // namespace

OperationTruth::OperationTruth(std::uint64_t seed, int width_px, int height_px, Happenings happenings, bool reference)
    : happenings_(std::move(happenings)), reference_(reference) {
  Numbers drawn(hashed_word(seed, 1));
  // The scope comes from below along the patient's z axis; so all sensors stay before the transmitter, and in range.
  at_rest_ = {rotation_exp(drawn.within(0.25)), Vector3d(Vector3d(480, 0, 120) + drawn.within(30))};
  // Six markers on the skin round about the organ, in a CT of 100 x 110 x 90 mm that begins at (-20, -20, -20).
  fiducials_mm_ = {{0, 0, 0}, {60, 5, -5}, {65, 75, 0}, {-5, 70, 20}, {30, 20, 55}, {35, 70, 50}};
  for (Vector3d& place : fiducials_mm_) place += drawn.within(4);
  target_mm_ = organ_middle_mm() + drawn.within(8);
  for (face_mm_ = target_mm_; organ_mm(face_mm_) < 0;) face_mm_.z() -= 1;
  hand_.rest_at({0, 0, 200}, 0);
  // Each of these follows from a word of its own: nothing else of a seed changes with them.
  Numbers of_pointer(hashed_word(seed, 22));
  tip_in_pointer_mm_ = Vector3d(0, 0, 150) + Vector3d(1, 1, 3).cwiseProduct(of_pointer.within(12));
  camera_name_ = "sim:camera-" + serial_of(hashed_word(seed, 23));
  const CameraModel lens = laparoscope_lens(width_px, height_px);
  CameraModel narrower = lens;
  narrower.fx_px *= 1.2;
  narrower.fy_px *= 1.2;
  scopes_ = {calibrated(lens, {rotation_exp(Vector3d(0.2, -0.1, 1.5)), {6, -14, -300}}, hashed_word(seed, 2)),
             calibrated(narrower, {rotation_exp(Vector3d(-0.1, 0.2, -0.7)), {-9, 12, -320}}, hashed_word(seed, 13))};
}

/// found: camera_from_sensor. The scope is calibrated as an engineer does it with 20 stations over a board 100 mm away:
/// hand-eye is off by rotations and translations about the camera, of these sigmas. The record has what was found, and
/// how good it is.
OperationTruth::Scope OperationTruth::calibrated(const CameraModel& lens, const Transform<Camera, Sensor>& found,
                                                 std::uint64_t seed) const {
  constexpr double kTurned_rad = 0.002, kShifted_mm = 0.2, kLens = 0.0004;  // kLens: of the focal length
  constexpr int kStations = 20;
  Numbers drawn(seed);
  const Vector3d turned = drawn.normal(kTurned_rad), shifted = drawn.normal(kShifted_mm);
  const Transform<Camera, Sensor> camera_from_sensor(rotation_exp(turned) * found.rotation(),
                                                     Vector3d(rotation_exp(turned) * found.translation() + shifted));
  // The solver's own terms: exp(w) R and t + d, with d = w x t and the shift.
  Eigen::Matrix<double, 6, 6> by = Eigen::Matrix<double, 6, 6>::Identity();
  by.bottomLeftCorner<3, 3>() = -cross_matrix(found.translation());
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << Vector3d::Constant(kTurned_rad), Vector3d::Constant(kShifted_mm);

  CameraModel found_lens = lens;
  const double lens_px = kLens * lens.fx_px;
  const Vector3d focal = drawn.normal(lens_px), middle = drawn.normal(lens_px);
  found_lens.fx_px += focal.x();
  found_lens.fy_px += focal.y();
  found_lens.cx_px += middle.x();
  found_lens.cy_px += middle.y();
  CameraMatrix lens_covariance = CameraMatrix::Zero();
  lens_covariance.topLeftCorner<4, 4>().diagonal().setConstant(lens_px * lens_px);

  // Held out, at the board: hand-eye's own error, and that of a pose at the end of the scope; of two axes.
  const double own_mm = std::hypot(kTurned_rad * kLook_mm, kShifted_mm);
  const double arm_mm = found.translation().norm() + kLook_mm;
  const double pose_mm = std::hypot(kNoise.position_mm, kNoise.angle_deg * kRadPerDeg * arm_mm);
  const double held_out_mm = std::sqrt(2.0) * std::hypot(own_mm, pose_mm);

  calibration::CalibrationRecord record;
  record.scope = "LAP-" + serial_of(seed);
  record.tracker = {{"model", "6DFOB"}};
  record.camera = {{"model", "simulated"}, {"serial", camera_name_}};
  const calibration::Provenance provenance{"2026-11-26T09:30:00Z", "birdseye-sim", "the truth", Grade::pass};
  record.lens = calibration::LensEntry{provenance, found_lens, "radial3_tangential2", lens_covariance,
                                       lens_px,    lens_px,    std::nullopt,          std::nullopt};
  record.hand_eye = calibration::HandEyeEntry{provenance,
                                              found,
                                              by * sigma.cwiseAbs2().asDiagonal() * by.transpose(),
                                              held_out_mm * lens.fx_px / kLook_mm,
                                              held_out_mm * lens.fx_px / kLook_mm,
                                              held_out_mm,
                                              std::nullopt,
                                              kStations};
  record.latency = calibration::LatencyEntry{provenance, 0, -1, 1, 0};
  return {lens, camera_from_sensor, found, std::move(record)};
}

/// An oblique scope: its rod's axis lies aside of the camera's. Both rods are read off at one angle; each was
/// calibrated at another.
void OperationTruth::fit_rods(std::uint64_t seed) {
  constexpr double kHasOne = 0.25, kReads_deg = 90, kTurned_deg = 60, kOblique_rad = 0.12, kBeside_mm = 2;
  const double reads_deg = Numbers(hashed_word(seed, 25)).within(kReads_deg).x();
  for (std::size_t scope = 0; scope < scopes_.size(); ++scope) {
    const std::uint64_t own = hashed_word(hashed_word(seed, 24), scope);
    Numbers drawn(own);
    const Vector3d turned_deg = drawn.within(kTurned_deg), tilted = drawn.within(kOblique_rad),
                   beside_mm = drawn.within(kBeside_mm);
    if (hashed_uniform(own, std::uint64_t{1} << 32) >= kHasOne) continue;
    Scope& one = scopes_[scope];
    const Transform<Camera, Sensor> found = one.found_camera_from_sensor;
    RodScope rod{found, found.rotation().transpose() * (rotation_exp(tilted) * Vector3d::UnitZ()),
                 found.inverse() * beside_mm, 1};
    one.record.hand_eye->rod = calibration::RodEntry{reads_deg - turned_deg.x(), rod.axis_in_sensor,
                                                     rod.axis_point_in_sensor_mm, rod.picture_turn};
    one.found_camera_from_sensor = rod.camera_from_sensor(turned_deg.x() * kRadPerDeg);
    rod.camera_from_sensor_at_zero = one.camera_from_sensor;
    one.camera_from_sensor = rod.camera_from_sensor(turned_deg.x() * kRadPerDeg);
    rod_angle_deg_ = reads_deg;
  }
}

const Vector3d& OperationTruth::organ_middle_mm() {
  static const Vector3d middle_mm(30, 35, 20);
  return middle_mm;
}

/// A liver, as small as the CT.
double OperationTruth::organ_mm(const Vector3d& point_in_patient_mm) {
  constexpr double kScale = 0.4;
  const Vector3d middle_of_body_mm(-40, -10, 20);
  return kScale * procedural_liver_mm((point_in_patient_mm - organ_middle_mm()) / kScale + middle_of_body_mm);
}

Transform<Tracker, Patient> OperationTruth::tracker_from_patient(double at_s) const {
  const Vector3d table_mm(30, 140, 20);  // the patient lies on it
  return happenings_.transmitter(at_s) * at_rest_ * happenings_.table(at_s, table_mm) *
         happenings_.patient(at_s, table_mm);
}

void OperationTruth::exchange_scopes(std::vector<double> at_s) {
  exchanged_at_s_ = std::move(at_s);
}

std::size_t OperationTruth::scope_in_use(double at_s) const {
  return static_cast<std::size_t>(
             std::ranges::count_if(exchanged_at_s_, [at_s](double then) { return then <= at_s; })) %
         2;
}

void OperationTruth::hurry(double from_s) {
  hurried_s_.push_back(from_s);
  if (hurried_s_.size() <= kHurriesRemembered) return;
  hurried_s_.pop_front();
  ahead_s_ += kHurryAhead_s;
}

/// How far the scope is on its way: as long as it goes at its usual pace, where nobody hurried it.
double OperationTruth::on_its_way_s(double at_s) const {
  double way_s = at_s + ahead_s_;
  for (const double from_s : hurried_s_) way_s += kHurryAhead_s * ease((at_s - from_s) / kHurry_s);
  return way_s;
}

/// From rest to rest: to each side, up and down, nearer and farther, turning about each axis.
OperationTruth::Swing OperationTruth::swing(double at_s) const {
  constexpr double kTurn_rad = 0.35, kShift_mm = 20;
  Swing out;
  for (const double from_s : hurried_s_) {
    const double u = (at_s - from_s) / kHurry_s;
    if (u <= 0 || u >= 1) continue;
    const double share = std::pow(std::sin(M_PI * u), 2), round = 2 * M_PI * u;
    const Vector3d way(std::sin(round), std::cos(round), std::sin(2 * round));
    out.turn += share * kTurn_rad * way;
    out.shift_mm += share * kShift_mm * way;
  }
  return out;
}

/// The scope turns about the target as about a port; it goes with the patient, in whose wall it is.
Transform<Camera, Patient> OperationTruth::camera_within_patient(double at_s) const {
  const double way_s = on_its_way_s(at_s);
  const Swing more = swing(at_s);
  const Eigen::Matrix3d turn =
      rotation_exp(Vector3d(more.turn + Vector3d(0.25 * std::sin(0.7 * way_s), 0.3 * std::sin(0.5 * way_s + 1),
                                                 0.2 * std::sin(0.3 * way_s))));
  const Vector3d aside(more.shift_mm + Vector3d(8 * std::sin(0.45 * way_s), 6 * std::cos(0.6 * way_s),
                                                kLook_mm + 10 * std::sin(0.35 * way_s)));
  return {turn, Vector3d(aside - turn * target_mm_)};
}

CameraModel OperationTruth::lens(double at_s) const {
  CameraModel zoomed = lens_of(scope_in_use(at_s));
  zoomed.fx_px *= zoom(at_s);
  zoomed.fy_px *= zoom(at_s);
  return zoomed;
}

void OperationTruth::enter_round_field(std::size_t scope, const std::optional<RoundField>& seen) {
  scopes_[scope].record.lens->round_field = seen;
}

OrganChange OperationTruth::organ(double at_s) const {
  return {.hollow = happenings_.hollow(at_s, face_mm_, -Vector3d::UnitZ(), Vector3d::UnitX()),
          .shift_mm = happenings_.breath_mm(at_s)};
}

/// The holder carries the bird, and the scope turns in it.
Transform<Camera, Patient> OperationTruth::camera_from_patient(double at_s) const {
  return happenings_.scope(at_s) * unturned_camera_from_patient(at_s);
}

Transform<Camera, Patient> OperationTruth::unturned_camera_from_patient(double at_s) const {
  if (!bench_ || at_s > left_board_s_ + kCarry_s) return camera_within_patient(at_s);
  const Transform<Tracker, Patient> on = tracker_from_patient(at_s);
  const Transform<Tracker, Camera> over_board =
      happenings_.transmitter(at_s) * bench_->at(std::min(at_s, left_board_s_));
  const Transform<Tracker, Camera> there = on * camera_within_patient(at_s).inverse();
  return between(over_board, there, ease((at_s - left_board_s_) / kCarry_s)).inverse() * on;
}

Transform<Camera, Marker> OperationTruth::camera_from_marker(double at_s) const {
  return happenings_.scope(at_s) * bench_->at(at_s).inverse() * bench_->tracker_from_marker();
}

/// As far from the transmitter as the patient, so that all sensors are in range above it too.
Result<void> OperationTruth::begin_at_board(std::uint64_t seed) {
  const Vector3d place_mm(380, -30, 160);
  auto bench =
      BenchPath::create(Transform<Tracker, Marker>(at_rest_.rotation(), place_mm), lens(0), hashed_word(seed, 7));
  if (!bench) return std::move(bench).error();
  bench_ = *std::move(bench);
  return {};
}

Transform<Tracker, Sensor> OperationTruth::tracker_from_sensor(std::size_t bird, double at_s) const {
  const Transform<Tracker, Patient> on = tracker_from_patient(at_s);
  if (bird == 0)
    return on * unturned_camera_from_patient(at_s).inverse() * scopes_[scope_in_use(at_s)].camera_from_sensor;
  if (bird == 2) return on * patient_from_reference_ * happenings_.reference(at_s);
  const HandPath::Place place = hand_.at(at_s);
  const Transform<Patient, Sensor> pointer(place.turn,
                                           Vector3d(place.tip_in_patient_mm - place.turn * tip_in_pointer_mm_));
  return on * pointer;
}

}  // namespace birdseye::hw_sim
