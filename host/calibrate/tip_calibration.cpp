#include "host/calibrate/tip_calibration.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "calibration/base/median.hpp"
#include "calibration/points/pivot_verdict.hpp"

namespace birdseye::host {

namespace {

/// A solver's refusal: poses that do not suffice are a verdict, others an error.
Result<void> take_refusal(const Error& error, Verdict& verdict, const char* next_step) {
  if (error.code != Errc::degenerate) return error;
  verdict.add(Grade::fail, error.what, next_step);
  return {};
}

void add_verdict(Verdict& to, const Verdict& more) {
  for (const std::string& reason : more.reasons) to.add(more.grade, reason);
  for (const std::string& step : more.next_steps) to.add(Grade::pass, {}, step);
}

/// A fit so bad that another reading of the file may be the right one, and how much better that must fit.
constexpr double kBadFit_mm = 2.5, kFarBetter = 3;

/// The pose if w stood first among the file's four numbers, which were read with w last.
Transform<Tracker, Sensor> with_w_first(const Transform<Tracker, Sensor>& pose) {
  const Eigen::Quaterniond read = pose.quaternion();
  return {Eigen::Quaterniond(read.x(), read.y(), read.z(), read.w()), pose.translation()};
}

void judge_quaternion_order(const TipInput& input, const calibration::Pivot& pivot, Verdict& verdict) {
  const double as_read_mm = median_of(pivot.residuals_mm);
  if (as_read_mm < kBadFit_mm) return;
  auto poses = input.poses;
  for (calibration::PivotPose& one : poses) {
    auto& pose = one.tracker_from_sensor;
    const auto turned_round = [&] {
      const auto back = pose.inverse();
      return Transform<Tracker, Sensor>(back.rotation(), back.translation());
    };
    if (input.inverted) pose = turned_round();  // as the file has it
    pose = with_w_first(pose);
    if (input.inverted) pose = turned_round();
  }
  const auto other = calibration::solve_pivot(poses);
  if (!other) return;
  const double w_first_mm = median_of(other->residuals_mm);
  if (w_first_mm > as_read_mm / kFarBetter) return;
  verdict.add(Grade::fail,
              fmt::format("the quaternions seem to have w first: the tip is {:.1f} mm from its pivot (median) as the "
                          "poses are read, with w last, and {:.1f} mm with w first",
                          as_read_mm, w_first_mm),
              "name the columns in a header: qw,qx,qy,qz");
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

/// Lengths in cm or inches pass for a short pointer near the tracker. An optical tracker is a metre or more away, which
/// is 100 cm; an electromagnetic one may be as near as that.
void judge_unit(const TipInput& input, double tip_mm, double divot_mm, Verdict& verdict) {
  constexpr double kNone_mm = 5, kVeryShort_mm = 25, kShort_mm = 60, kNearTracker_mm = 300;
  if (input.unit_said) return;
  const bool near_tracker = !input.relative && divot_mm < kNearTracker_mm;
  if (tip_mm < kNone_mm || tip_mm > (near_tracker ? kShort_mm : kVeryShort_mm)) return;
  verdict.add(
      Grade::marginal,
      fmt::format("the tip is only {:.1f} mm from the sensor, and the divot {:.0f} mm from the tracker's origin",
                  tip_mm, divot_mm),
      "if the lengths of the poses are in cm or inches, say so: --unit cm or --unit in; if they are in mm, say --unit "
      "mm");
}

void judge_reading(const TipInput& input, const calibration::Pivot& pivot, Verdict& verdict) {
  const double tip_mm = pivot.robust.tip_in_sensor_mm.norm();
  double divot_mm = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& place : pivot.robust.pivots_in_tracker_mm) divot_mm = std::min(divot_mm, place.norm());
  judge_quaternion_order(input, pivot, verdict);
  if (median_of(pivot.residuals_mm) >= kBadFit_mm) return;  // no tip, whose length would tell anything
  judge_direction(input, tip_mm, divot_mm, verdict);
  judge_unit(input, tip_mm, divot_mm, verdict);
}

}  // namespace

Result<TipInput> tip_input_of(PoseSet set, const std::vector<Phase>& phases) {
  TipInput input;
  input.set = std::move(set);
  if (phases.empty()) {
    for (const TimedPose& pose : input.set.poses) input.poses.push_back({pose.tracker_from_sensor, 0, pose.time_s});
    return input;
  }
  auto divots = divots_of(phases, input.set);
  if (!divots) return divots.error();
  std::vector<TimedPose> kept;
  for (std::size_t i = 0; i < divots->size(); ++i) {
    if (!(*divots)[i]) continue;
    kept.push_back(input.set.poses[i]);
    input.poses.push_back({kept.back().tracker_from_sensor, *(*divots)[i], kept.back().time_s});
  }
  input.set.poses = std::move(kept);
  input.divots = phases.size();
  return input;
}

Result<TipFound> calibrate_tip(const TipInput& input) {
  TipFound out;
  if (auto pivot = calibration::solve_pivot(input.poses); pivot) {
    out.pivot = *std::move(pivot);
    out.verdict = calibration::judge_pivot(*out.pivot);
    judge_reading(input, *out.pivot, out.verdict);
  } else if (const auto taken = take_refusal(pivot.error(), out.verdict, "record while the pointer is tilted");
             !taken) {
    return taken.error();
  }
  if (!input.spin) return out;
  std::vector<Transform<Tracker, Sensor>> spun;
  for (const TimedPose& pose : input.spin->poses) spun.push_back(pose.tracker_from_sensor);
  const Eigen::Vector3d tip = out.pivot ? out.pivot->robust.tip_in_sensor_mm : Eigen::Vector3d::UnitZ();
  if (auto axis = calibration::solve_spin_axis(spun, tip); axis) {
    out.axis = *std::move(axis);
    add_verdict(out.verdict, calibration::judge_spin_axis(*out.axis));
  } else if (const auto taken = take_refusal(axis.error(), out.verdict, "record while the pointer is spun"); !taken) {
    return taken.error();
  }
  return out;
}

}  // namespace birdseye::host
