#include "host/calibrate/tip_calibration.hpp"

#include <fmt/format.h>

#include <utility>

#include "calibration/points/pivot_verdict.hpp"
#include "host/calibrate/tip_reading.hpp"

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

/// Poses that were left out say nothing against the tip. But the reader is to know on how much of the recording the tip
/// stands.
void judge_left_out(const PoseSet& set, Verdict& verdict) {
  constexpr double kMost_percent = 50;
  if (set.rejected.empty()) return;
  const auto all = static_cast<double>(set.poses.size() + set.rejected.size());
  const double percent = 100 * static_cast<double>(set.rejected.size()) / all;
  verdict.add(percent > kMost_percent ? Grade::marginal : Grade::pass,
              fmt::format("{} of {:.0f} poses could not be read or used, and were left out", set.rejected.size(), all),
              percent > kMost_percent
                  ? "see why they were left out, and record again where the tracker sees the pointer"
                  : std::string());
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
    judge_left_out(input.set, out.verdict);
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
