#include "host/calibrate/tip_reading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

#include "calibration/base/median.hpp"
#include "calibration/geometry/quaternion_order.hpp"

namespace birdseye::host {

namespace {

using Pose = Transform<Tracker, Sensor>;

/// A fit so bad that another reading of the file may be the right one, and how much better that must fit.
constexpr double kBadFit_mm = 2.5, kFarBetter = 3;

template <QuaternionOrder order>
Pose with_quaternion(const Pose& pose) {
  return {reordered(pose.rotation(), order), pose.translation()};
}

Pose with_rotation_inverted(const Pose& pose) {
  return {Eigen::Matrix3d(pose.rotation().transpose()), pose.translation()};
}

template <int axis>
Pose with_axis_mirrored(const Pose& pose) {
  Eigen::Vector3d position_mm = pose.translation();
  position_mm[axis] = -position_mm[axis];
  return {pose.rotation(), position_mm};
}

/// How else a file may be meant.
struct OtherReading {
  const char* seems;
  Pose (*read)(const Pose& as_in_file);
  const char* read_so;
  const char* remedy;
};

constexpr const char* kOneHand = "export both in the same right-handed axes";

constexpr std::array kOtherReadings{
    OtherReading{"the quaternions seem to have w first", with_quaternion<QuaternionOrder::w_first>, "with w first",
                 "name the columns in a header: qw,qx,qy,qz"},
    OtherReading{"the quaternions seem to have w last", with_quaternion<QuaternionOrder::w_last>, "with w last",
                 "name the columns in a header: qx,qy,qz,qw"},
    OtherReading{"the rotations seem to go the other way than the positions", with_rotation_inverted,
                 "with each rotation inverted",
                 "export the rotation that takes the sensor's axes to the tracker's, beside the sensor's position"},
    OtherReading{"positions and rotations seem to be of different axes", with_axis_mirrored<0>, "with x mirrored",
                 kOneHand},
    OtherReading{"positions and rotations seem to be of different axes", with_axis_mirrored<1>, "with y mirrored",
                 kOneHand},
    OtherReading{"positions and rotations seem to be of different axes", with_axis_mirrored<2>, "with z mirrored",
                 kOneHand},
};

/// The tip's median distance from its pivot, if the file is read so.
double residual_mm(const TipInput& input, const OtherReading& other) {
  auto poses = input.poses;
  for (calibration::PivotPose& one : poses) {
    Pose& pose = one.tracker_from_sensor;
    pose = input.inverted ? turned_round(other.read(turned_round(pose))) : other.read(pose);
  }
  const auto pivot = calibration::solve_pivot(poses);
  return pivot ? median_of(pivot->residuals_mm) : std::numeric_limits<double>::infinity();
}

void judge_other_readings(const TipInput& input, double as_read_mm, Verdict& verdict) {
  const OtherReading* best = nullptr;
  double best_mm = as_read_mm / kFarBetter;
  for (const OtherReading& other : kOtherReadings) {
    const double off_mm = residual_mm(input, other);
    if (off_mm > best_mm) continue;
    best = &other;
    best_mm = off_mm;
  }
  if (!best) return;
  verdict.add(Grade::fail,
              fmt::format("{}: the tip is {:.1f} mm from its pivot (median) as the poses are read, and {:.1f} mm {}",
                          best->seems, as_read_mm, best_mm, best->read_so),
              best->remedy);
}

/// A pivot fits inverted poses as well as it fits the right ones: tip and divot then change places. What tells them
/// apart is that a tip is near its sensor, and a tracker far from both.
void judge_direction(const TipInput& input, double tip_mm, double divot_mm, Verdict& verdict) {
  if (input.relative || input.direction_said || input.set.direction_known || divot_mm > tip_mm) return;
  verdict.add(Grade::fail,
              fmt::format("the tip would be {:.0f} mm from the sensor, and the divot only {:.0f} mm from the tracker's "
                          "origin: the poses seem to be inverted",
                          tip_mm, divot_mm),
              fmt::format("if the pointer is {:.0f} mm long, say --poses-are sensor_from_tracker; if it is {:.0f} mm "
                          "long, say --poses-are tracker_from_sensor",
                          divot_mm, tip_mm));
}

/// Lengths in cm or inches pass for a short pointer near the tracker, and every touch would be off by the pointer's
/// length. An optical tracker is a metre or more away, which is 100 cm; an electromagnetic one may be as near as that.
void judge_unit(const TipInput& input, double tip_mm, double divot_mm, Verdict& verdict) {
  constexpr double kNone_mm = 5, kVeryShort_mm = 25, kShort_mm = 60, kNearTracker_mm = 300;
  if (input.unit_said) return;
  const bool near_tracker = !input.relative && divot_mm < kNearTracker_mm;
  if (tip_mm < kNone_mm || tip_mm > (near_tracker ? kShort_mm : kVeryShort_mm)) return;
  verdict.add(
      Grade::fail,
      fmt::format("the tip is only {:.1f} mm from the sensor, and the divot {:.0f} mm from the tracker's origin, if "
                  "the lengths are in mm, as nobody said",
                  tip_mm, divot_mm),
      "say the unit of the poses' lengths: --unit cm, --unit in, or, if the pointer is that short, --unit mm");
}

}  // namespace

void judge_reading(const TipInput& input, const calibration::Pivot& pivot, Verdict& verdict) {
  const double tip_mm = pivot.robust.tip_in_sensor_mm.norm();
  double divot_mm = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& place : pivot.robust.pivots_in_tracker_mm) divot_mm = std::min(divot_mm, place.norm());
  const double as_read_mm = median_of(pivot.residuals_mm);
  if (as_read_mm >= kBadFit_mm) return judge_other_readings(input, as_read_mm, verdict);  // its length tells nothing
  judge_direction(input, tip_mm, divot_mm, verdict);
  judge_unit(input, tip_mm, divot_mm, verdict);
}

}  // namespace birdseye::host
