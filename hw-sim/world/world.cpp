#include "hw-sim/world/world.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "hw-sim/camera/look_at.hpp"
#include "hw-sim/phantom/implants.hpp"
#include "hw-sim/world/between.hpp"
#include "hw-sim/world/board_stations.hpp"
#include "hw-sim/world/ease.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

constexpr std::size_t kStations = 24;
constexpr double kMoveS = 0.14;                           // from station to station over the board
constexpr double kTouchDwellS = 0.7, kTouchMoveS = 0.75;  // of the pointer
constexpr double kCarryS = 2;                             // of the scope from the board to the patient
constexpr double kViewDwellS = 0.8, kViewMoveS = 0.45;    // of the scope about the liver
constexpr double kSweepS = 7;                             // there and back
constexpr double kRangeMm = 700;                          // of the transmitter

Vector3d rotation_vector(const Vector3d& axis_deg) {
  return axis_deg * kRadPerDeg;
}

}  // namespace

Result<World> World::create(const PhantomTruth& truth, const Mesh& liver, const CameraModel& lens, std::uint64_t seed,
                            const Pace& pace, const Mesh* moved, Happenings happenings, ReferenceOn reference) {
  World world;
  world.happenings_ = std::move(happenings);
  world.reference_ = reference;
  world.dwell_s_ = pace.dwell_s;
  world.truth_ = truth;
  // The bird sits on the scope's handle, its axes askew, 280 mm behind the lens.
  world.camera_from_sensor_ =
      Transform<Camera, Sensor>(rotation_exp(rotation_vector({14, -9, 6})) *
                                    Eigen::Matrix3d(Eigen::AngleAxisd(-0.5 * std::numbers::pi, Vector3d::UnitY())),
                                Vector3d(6, -14, -280));
  world.tip_in_pointer_mm_ = {158, -6, 11};

  // The transmitter stands on the patient's left: its x towards the patient's right, its z down to the table.
  Eigen::Matrix3d axes;
  axes << -1, 0, 0, 0, 0, 1, 0, 1, 0;
  const Eigen::Matrix3d rotation = rotation_exp(rotation_vector({7, -11, 16})) * axes;
  const Vector3d transmitter = truth.liver_centre_mm + Vector3d(330, -110, -150);
  world.tracker_from_patient_ = Transform<Tracker, Patient>(rotation, Vector3d(-(rotation * transmitter)));
  world.tracker_from_marker_ =
      Transform<Tracker, Marker>(rotation_exp(rotation_vector({5, 4, 35})), Vector3d(330, -150, 140));

  // On the lower chest, which the breath hardly lifts, or on the table's rail, beside the hip.
  const Vector3d from_liver = reference == ReferenceOn::table ? Vector3d(150, 130, -120) : Vector3d(80, -150, 130);
  world.patient_from_reference_ =
      Transform<Patient, Sensor>(rotation_exp(rotation_vector({12, -20, 35})), truth.liver_centre_mm + from_liver);

  // What the scope looks at: the point of the liver's face that the line from the tumour towards the port goes through.
  const Vector3d outward = towards_scope();
  double nearest = std::numeric_limits<double>::max();
  world.look_at_in_patient_mm_ = truth.tumour_centre_mm;
  for (const Eigen::Vector3f& vertex : liver.vertices) {
    const Vector3d from_tumour = vertex.cast<double>() - truth.tumour_centre_mm;
    const double aside = (from_tumour - from_tumour.dot(outward) * outward).norm();
    if (from_tumour.dot(outward) > 0 && aside < nearest) {
      nearest = aside;
      world.look_at_in_patient_mm_ = vertex.cast<double>();
    }
  }
  for (const auto& station : stations_over(world.board_, lens, seed, kStations))
    world.stations_.push_back(world.tracker_from_marker_ * station);
  if (pace.views) world.plan_views();

  const Vector3d park_in_patient_mm = truth.liver_centre_mm + Vector3d(170, -190, -40);
  const Vector3d park = world.tracker_from_patient_ * park_in_patient_mm;
  world.tip_stops_in_tracker_mm_.push_back(park);
  for (const Vector3d& fiducial : truth.fiducials_mm) {
    world.tip_stops_in_tracker_mm_.push_back(world.tracker_from_patient_ * fiducial);
  }
  world.tip_stops_in_tracker_mm_.push_back(park);

  if (pace.strokes) {
    // The hand is at the upper end of the shaft, which stands along the tracker's z.
    const Vector3d towards_hand = -(world.tracker_from_patient_.rotation().transpose() * Vector3d::UnitZ());
    world.stroke_ = StrokePath::over(moved != nullptr ? *moved : liver, towards_hand, park_in_patient_mm);
    if (!(world.stroke_.lasts_s() > 0))
      return Error{Errc::bad_value, "no part of the liver faces the hand with the pointer; leave out --strokes"};
  }

  const auto stops = static_cast<double>(world.tip_stops_in_tracker_mm_.size());
  world.calibrate_s_ = pace.sway_s;
  world.touch_s_ = world.calibrate_s_ + static_cast<double>(kStations) * (pace.dwell_s + kMoveS) + pace.pause_s;
  world.stroke_s_ = world.touch_s_ + stops * kTouchDwellS + (stops - 1) * kTouchMoveS;
  world.views_s_ = world.stroke_s_ + world.stroke_.lasts_s();
  world.look_s_ = world.views_s_ + static_cast<double>(world.views_.size()) * (kViewDwellS + kViewMoveS);
  world.ends_s_ = world.look_s_ + pace.look_s;
  if (pace.sway_s > 0) world.stages_.push_back({"sway", 0});
  world.stages_.insert(world.stages_.end(), {{"calibrate", world.calibrate_s_}, {"touch", world.touch_s_}});
  if (pace.strokes) world.stages_.push_back({"stroke", world.stroke_s_});
  if (pace.views) world.stages_.push_back({"views", world.views_s_});
  world.stages_.insert(world.stages_.end(), {{"look", world.look_s_}, {"end", world.ends_s_}});
  if (const auto in_range = world.check_range(); !in_range) return in_range.error();
  return world;
}

void World::plan_views() {
  constexpr double kFromFaceMm = 112;
  // Neighbours see the same of it from sides 18 to 23 degrees apart.
  constexpr std::array<std::array<double, 2>, 5> kAsideDeg{{{-32, 0}, {-16, 8}, {0, -8}, {16, 8}, {32, 0}}};
  const Vector3d out = towards_scope();
  const Vector3d right = out.cross(Vector3d::UnitZ()).normalized();
  const Vector3d up = right.cross(out);
  for (const auto& [across, along] : kAsideDeg) {
    const Vector3d direction =
        rotation_exp(up * (across * kRadPerDeg)) * (rotation_exp(right * (along * kRadPerDeg)) * out);
    const Vector3d eye = look_at_in_patient_mm_ + kFromFaceMm * direction;
    views_.push_back(tracker_from_patient_ * look_at<Patient>(eye, look_at_in_patient_mm_, Vector3d(0, 0, -1), 0));
  }
}

Result<void> World::check_range() const {
  constexpr double kEveryS = 0.05;
  for (int i = 0; i * kEveryS < ends_s(); ++i) {
    const double t = i * kEveryS;
    std::vector<Vector3d> birds{tracker_from_sensor(t).translation(), tracker_from_pointer(t).translation()};
    if (reference_ != ReferenceOn::nothing) birds.push_back(tracker_from_reference(t).translation());
    for (const Vector3d& p : birds) {
      if (p.x() < 20 || p.norm() > kRangeMm) {
        return Error{Errc::bad_value,
                     fmt::format("at {:.1f} s a bird would be at ({:.0f}, {:.0f}, {:.0f}) mm, out of the tracker's "
                                 "range; use a CT of a smaller region, or a script in which less moves",
                                 t, p.x(), p.y(), p.z())};
      }
    }
  }
  if (stations_.size() < kStations) {
    return Error{Errc::bad_value, "the board does not fit into the picture; use --size 768x576"};
  }
  return {};
}

Transform<Tracker, Camera> World::sweep(double since_s) const {
  constexpr double kPortMm = 205, kTipFromFaceMm = 108;
  const double phase = 2 * std::numbers::pi * since_s / kSweepS;
  const Vector3d out = towards_scope();
  const Vector3d port = look_at_in_patient_mm_ + kPortMm * out;
  const Vector3d right = out.cross(Vector3d::UnitZ()).normalized();
  const Vector3d up = right.cross(out);
  const Vector3d direction = rotation_exp(up * (9 * kRadPerDeg * std::sin(phase))) *
                             (rotation_exp(right * (5.5 * kRadPerDeg * std::sin(2 * phase))) * Vector3d(-out));
  const double insertion = kPortMm - kTipFromFaceMm + 12 * std::sin(phase + 1);
  const Vector3d eye = port + insertion * direction;
  const double roll = 14 * kRadPerDeg * std::sin(phase + 0.5);
  return tracker_from_patient_ * look_at<Patient>(eye, eye + direction, Vector3d(0, 0, -1), roll);
}

Transform<Tracker, Camera> World::about(double since_s) const {
  const double beat = since_s / (kViewDwellS + kViewMoveS);
  const auto view = std::min(static_cast<std::size_t>(beat), views_.size() - 1);
  const double into_s = (beat - static_cast<double>(view)) * (kViewDwellS + kViewMoveS);
  const Transform<Tracker, Camera> next = view + 1 < views_.size() ? views_[view + 1] : sweep(0);
  return between(views_[view], next, ease((into_s - kViewDwellS) / kViewMoveS));
}

/// Over the board's middle, turned about two axes and rolled at paces that do not repeat, as a hand would.
Transform<Tracker, Camera> World::sway(double world_s) const {
  const double fade = ease(world_s) * ease(calibrate_s_ - world_s);  // from rest, and back to it
  const auto wave = [world_s](double hz, double phase) {
    return std::sin(2 * std::numbers::pi * hz * world_s + phase + 0.8 * std::sin(0.9 * world_s + 2 * phase));
  };
  const Vector3d turn_deg(9 * wave(0.83, 0) + 4 * wave(1.37, 1), 10 * wave(0.71, 2) + 4 * wave(1.19, 3),
                          12 * wave(0.47, 4));
  const Vector3d eye(0.5 * (board_.columns - 1) * board_.square_mm, 0.5 * (board_.rows - 1) * board_.square_mm, -95);
  const Transform<Marker, Camera> still = look_at<Marker>(eye, Vector3d(eye.x(), eye.y(), 0), Vector3d(0, 1, 0), 0);
  const Transform<Camera, Camera> turned(rotation_exp(fade * rotation_vector(turn_deg)),
                                         Vector3d(fade * Vector3d(6 * wave(0.59, 5), 5 * wave(0.97, 6), 0)));
  const Transform<Tracker, Camera> swaying = tracker_from_marker_ * still * turned;
  // The last moment leads to the first station.
  constexpr double kToStationS = 0.5;
  return between(swaying, stations_.front(), ease((world_s - calibrate_s_ + kToStationS) / kToStationS));
}

/// Where the table and the patient on it have gone since the beginning, the transmitter as it was then.
Transform<Tracker, Tracker> World::carried(double world_s) const {
  const Vector3d table_mm = truth_.liver_centre_mm + Vector3d(0, 140, 0);
  const Transform<Patient, Patient> moved =
      happenings_.table(world_s, table_mm) * happenings_.patient(world_s, table_mm);
  if (moved.matrix() == Eigen::Matrix4d::Identity()) return {};  // to the last bit
  return tracker_from_patient_ * moved * tracker_from_patient_.inverse();
}

/// With the transmitter as it was at first. The bird goes as scripted; a camera that turns against it goes its own way.
Transform<Tracker, Camera> World::scripted_camera(double world_s) const {
  if (world_s < calibrate_s_) return sway(std::max(0.0, world_s));
  if (world_s >= look_s_) return carried(world_s) * sweep(std::min(world_s, ends_s_) - look_s_);
  if (world_s >= views_s_) return carried(world_s) * about(world_s - views_s_);
  if (world_s >= touch_s_) {
    const Transform<Tracker, Camera> there = carried(world_s) * (views_.empty() ? sweep(0) : views_.front());
    return between(stations_.back(), there, ease((world_s - touch_s_) / kCarryS));
  }
  const double beat = std::max(0.0, world_s - calibrate_s_) / (dwell_s_ + kMoveS);
  const auto station = std::min(static_cast<std::size_t>(beat), stations_.size() - 1);
  const double into_s = (beat - static_cast<double>(station)) * (dwell_s_ + kMoveS);
  // The move to the next station ends the beat; the last one just stays.
  const std::size_t next = std::min(station + 1, stations_.size() - 1);
  return between(stations_[station], stations_[next], ease((into_s - dwell_s_) / kMoveS));
}

Transform<Tracker, Camera> World::tracker_from_camera(double world_s) const {
  return happenings_.transmitter(world_s) * scripted_camera(world_s) * happenings_.scope(world_s).inverse();
}

Transform<Tracker, Sensor> World::tracker_from_sensor(double world_s) const {
  return happenings_.transmitter(world_s) * scripted_camera(world_s) * camera_from_sensor_;
}

Transform<Tracker, Sensor> World::tracker_from_reference(double world_s) const {
  const Vector3d table_mm = truth_.liver_centre_mm + Vector3d(0, 140, 0);
  const Transform<Tracker, Patient> on =
      reference_ == ReferenceOn::table
          ? happenings_.transmitter(world_s) * tracker_from_patient_ * happenings_.table(world_s, table_mm)
          : tracker_from_patient(world_s);
  return on * patient_from_reference_ * happenings_.reference(world_s);
}

Transform<Camera, Sensor> World::camera_from_sensor(double world_s) const {
  return happenings_.scope(world_s) * camera_from_sensor_;
}

Transform<Tracker, Patient> World::tracker_from_patient(double world_s) const {
  return happenings_.transmitter(world_s) * carried(world_s) * tracker_from_patient_;
}

Transform<Tracker, Marker> World::tracker_from_marker(double world_s) const {
  return happenings_.transmitter(world_s) * tracker_from_marker_;
}

OrganChange World::organ(double world_s) const {
  const Vector3d out = towards_scope();
  return {.hollow = happenings_.hollow(world_s, look_at_in_patient_mm_, out, out.cross(Vector3d::UnitZ()).normalized()),
          .shift_mm = happenings_.breath_mm(world_s)};
}

Transform<Tracker, Pointer> World::tracker_from_pointer(double world_s) const {
  return happenings_.transmitter(world_s) * carried(world_s) * scripted_pointer(world_s);
}

Transform<Tracker, Pointer> World::scripted_pointer(double world_s) const {
  const double beat = std::max(0.0, world_s - touch_s_) / (kTouchDwellS + kTouchMoveS);
  const std::size_t last = tip_stops_in_tracker_mm_.size() - 1;
  const auto stop = std::min(static_cast<std::size_t>(beat), last);
  const double into_s = (beat - static_cast<double>(stop)) * (kTouchDwellS + kTouchMoveS);
  const double u = ease((into_s - kTouchDwellS) / kTouchMoveS);
  const std::size_t next = std::min(stop + 1, last);
  Vector3d tip = tip_stops_in_tracker_mm_[stop] + u * (tip_stops_in_tracker_mm_[next] - tip_stops_in_tracker_mm_[stop]);
  if (stroke_.lasts_s() > 0 && world_s > stroke_s_)
    tip = tracker_from_patient_ * (stroke_.tip_in_patient_mm(world_s - stroke_s_) + happenings_.breath_mm(world_s));
  // The hand holds the pointer from in front of the patient, a little differently at each place.
  const auto hold = [](std::size_t i) {
    const auto a = static_cast<double>(i);
    return Vector3d(12 * std::sin(1.7 * a), 14 * std::cos(2.3 * a), 20 * std::sin(0.9 * a + 1));
  };
  const Vector3d lean = hold(stop) + u * (hold(next) - hold(stop));
  // The pointer's x runs down its shaft; down is the tracker's z.
  Eigen::Matrix3d shaft_down;
  shaft_down << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  const Eigen::Matrix3d rotation = rotation_exp(rotation_vector(lean)) * shaft_down;
  return Transform<Tracker, Pointer>(rotation, Vector3d(tip - rotation * tip_in_pointer_mm_));
}

}  // namespace birdseye::hw_sim
