#include "tests/e2e/fault_judge.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "calibration/geometry/transform.hpp"
#include "device/wire/json.hpp"

namespace birdseye::testing {

namespace {

constexpr double kSigmas = 6;
constexpr double kQuantumMm = 0.06;  // half a count in 914 mm, per axis, and rounding
constexpr double kSpeedMmS = 200 * std::numbers::pi;
constexpr double kTimeLimitS = 0.010;             // of [pose] max_time_sigma_ms: what TDATA promises
constexpr double kMachineMm = kSpeedMmS * 0.005;  // a simulator that is not let run delivers late, unknown to anybody
constexpr double kRecoversWithinS = 15;           // a busy machine; the table tells what it was
constexpr double kPredictedWorse = 3;             // a line through two readings, one of them wrong, 30 ms on
constexpr double kHoleS = 0.1;
constexpr double kSteadyS = 0.5;

double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

double off_mm(const Eigen::Vector3d& position_mm, DeviceTime acquired, std::int64_t zero_ns) {
  const double angle = std::numbers::pi * seconds(acquired.ns - zero_ns);
  return (position_mm - Eigen::Vector3d(400 + 200 * std::cos(angle), 200 * std::sin(angle), 0)).norm();
}

bool holds(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

bool shows(const Sign& sign, const Seen& seen, const std::optional<wire::Health>& before) {
  if (const auto* status = std::get_if<wire::Status>(&seen.event))
    return sign.where == Sign::Where::status && !status->ok && holds(status->text, sign.words);
  if (const auto* doubt = std::get_if<wire::Doubt>(&seen.event))
    return sign.where == Sign::Where::doubt && holds(doubt->why, sign.words);
  if (const auto* frame = std::get_if<wire::VideoFrame>(&seen.event)) {
    if (sign.where == Sign::Where::frame) return sign.check(*frame);
    return sign.where == Sign::Where::refused && frame->info.pose.kind == PoseKind::refused &&
           holds(frame->info.pose.reason, sign.words);
  }
  const auto* health = std::get_if<wire::Health>(&seen.event);
  if (health == nullptr || !before || sign.where != Sign::Where::counter) return false;
  return nlohmann::json(*health).at(sign.words).get<double>() > nlohmann::json(*before).at(sign.words).get<double>();
}

std::string words_of(const Sign& sign) {
  switch (sign.where) {
    case Sign::Where::status:
      return fmt::format("STATUS \"{}\"", sign.words);
    case Sign::Where::doubt:
      return fmt::format("Doubt \"{}\"", sign.words);
    case Sign::Where::refused:
      return fmt::format("pose refused: \"{}\"", sign.words);
    case Sign::Where::counter:
      return fmt::format("Health `{}`", sign.words);
    case Sign::Where::frame:
      break;
  }
  return sign.words;
}

struct PoseSaid {
  std::int64_t at_ns;
  DeviceTime acquired;
  double off_mm, bound_mm;
};

std::optional<PoseSaid> pose_of(const Seen& seen, std::int64_t zero_ns, const FaultCase& fault) {
  const double noise_mm = kSigmas * FaultRig::kNoiseMm + kQuantumMm;
  if (const auto* birds = std::get_if<wire::Birds>(&seen.event)) {
    if (birds->birds.empty()) return std::nullopt;
    const auto& position = birds->birds.front().tracker_from_sensor.translation();
    return PoseSaid{seen.at_ns, birds->acquired, off_mm(position, birds->acquired, zero_ns),
                    noise_mm + fault.extra_mm + kSpeedMmS * (kTimeLimitS + fault.extra_time_s)};
  }
  const auto* frame = std::get_if<wire::VideoFrame>(&seen.event);
  if (frame == nullptr || !frame->info.pose.tracker_from_sensor) return std::nullopt;
  const wire::FrameInfo& info = frame->info;
  const double time_s = kSigmas * std::hypot(seconds(info.acquired_sigma.ns), seconds(info.pose.time_sigma.ns));
  return PoseSaid{seen.at_ns, info.acquired,
                  off_mm(info.pose.tracker_from_sensor->translation(), info.acquired, zero_ns),
                  noise_mm + kPredictedWorse * fault.extra_mm + kSigmas * info.pose.position_sigma_mm +
                      kSpeedMmS * (time_s + fault.extra_time_s)};
}

/// From a fault's end to what is good, and stays so for a while where anything does.
std::optional<double> recovery_s(const std::vector<Seen>& seen, std::int64_t end_ns, std::int64_t until_ns,
                                 bool tracking) {
  std::int64_t good_since = 0, first_good = 0, last = end_ns;
  for (const Seen& each : seen) {
    if (each.at_ns <= end_ns || each.at_ns > until_ns) continue;
    DeviceTime acquired;
    bool good = false;
    if (tracking) {
      const auto* birds = std::get_if<wire::Birds>(&each.event);
      if (birds == nullptr) continue;
      acquired = birds->acquired;
      good = !birds->birds.empty();
    } else {
      const auto* frame = std::get_if<wire::VideoFrame>(&each.event);
      if (frame == nullptr) continue;
      acquired = frame->info.acquired;
      good = frame->info.pose.kind != PoseKind::refused;
    }
    if (acquired.ns <= end_ns) continue;
    if (!good || seconds(each.at_ns - last) > 2 * kHoleS) good_since = 0;
    last = each.at_ns;
    if (good && good_since == 0) good_since = each.at_ns;
    if (good && first_good == 0) first_good = each.at_ns;
    if (good && seconds(each.at_ns - good_since) >= kSteadyS) break;
  }
  if (first_good == 0) return std::nullopt;
  return seconds((good_since != 0 ? good_since : first_good) - end_ns);
}

}  // namespace

std::string script_of(const std::vector<FaultCase>& cases, double first_s, const std::string& of) {
  std::string text;
  double at_s = first_s;
  for (const FaultCase& fault : cases) {
    std::string parameters = fault.parameters;
    std::replace(parameters.begin(), parameters.end(), ',', '\n');
    text += fmt::format("[[fault]]\nname = \"{}\"\nof = \"{}\"\nat_s = {}\nfor_s = {}\n{}\n", fault.name, of, at_s,
                        fault.for_s, parameters);
    at_s += fault.for_s + fault.calm_s;
  }
  return text;
}

std::string text_of(const std::vector<Sign>& signs, const std::string& note) {
  std::string text;
  for (const Sign& sign : signs) text += (text.empty() ? "" : "; ") + words_of(sign);
  if (!note.empty()) text += (text.empty() ? "" : ". ") + note;
  return text;
}

bool stood_still(const std::vector<Seen>& seen, const FaultSpan& span, std::int64_t until_ns, bool of_tracker) {
  constexpr std::int64_t kStillNs = 90'000'000;
  std::int64_t other_ns = span.begin_ns;
  for (const Seen& each : seen) {
    if (each.at_ns < span.begin_ns - kStillNs || each.at_ns > until_ns) continue;
    const auto* frame = std::get_if<wire::VideoFrame>(&each.event);
    const auto* birds = std::get_if<wire::Birds>(&each.event);
    if (frame != nullptr && ((frame->info.arrived - frame->info.acquired).ns > kStillNs ||
                             each.at_ns - frame->info.arrived.ns > kStillNs)) {
      return true;
    }
    if (birds != nullptr && each.at_ns - birds->acquired.ns > kStillNs) return true;
    if (of_tracker ? frame == nullptr : birds == nullptr) continue;
    if (each.at_ns - other_ns > kStillNs) return true;
    other_ns = each.at_ns;
  }
  return until_ns - other_ns > kStillNs;
}

FaultRow judge(const FaultCase& fault, const FaultSpan& span, std::int64_t until_ns, bool of_tracker,
               std::int64_t circle_zero_ns, const std::vector<Seen>& seen, std::vector<std::string>& problems) {
  FaultRow row;
  row.fault = (of_tracker ? "tracker " : "camera ") + fault.name;
  row.how = fault.parameters.empty() ? fmt::format("{} s", fault.for_s)
                                     : fmt::format("{} s, {}", fault.for_s, fault.parameters);
  row.seen = text_of(fault.signs, fault.note);
  const auto complain = [&](const std::string& what) { problems.push_back(row.fault + ": " + what); };

  std::optional<wire::Health> before;
  std::vector<bool> shown(fault.signs.size());
  std::vector<std::string> said;
  int others = 0;
  for (const Seen& each : seen) {
    if (const auto* health = std::get_if<wire::Health>(&each.event); health != nullptr && each.at_ns < span.begin_ns)
      before = *health;
    if (each.at_ns < span.begin_ns || each.at_ns > until_ns) continue;
    for (std::size_t i = 0; i < fault.signs.size(); ++i) shown[i] = shown[i] || shows(fault.signs[i], each, before);
    if (const auto* status = std::get_if<wire::Status>(&each.event)) said.push_back("STATUS " + status->text);
    if (const auto* doubt = std::get_if<wire::Doubt>(&each.event)) said.push_back("Doubt " + doubt->why);
    if (const auto* frame = std::get_if<wire::VideoFrame>(&each.event);
        frame != nullptr && frame->info.pose.kind == PoseKind::refused)
      said.push_back("refused " + frame->info.pose.reason);
    if (const auto* health = std::get_if<wire::Health>(&each.event)) said.push_back(nlohmann::json(*health).dump());
    if (of_tracker ? std::holds_alternative<wire::VideoFrame>(each.event)
                   : std::holds_alternative<wire::Birds>(each.event))
      ++others;
    const auto pose = pose_of(each, circle_zero_ns, fault);
    if (!pose || pose->acquired.ns < span.begin_ns) continue;
    if (pose->off_mm / pose->bound_mm > row.worst_mm.value_or(0) / row.promised_mm.value_or(1)) {
      row.worst_mm = pose->off_mm;
      row.promised_mm = pose->bound_mm;
    }
    if (pose->off_mm > pose->bound_mm + kMachineMm && !fault.poses_lie) {
      complain(fmt::format("{} published {:.1f} mm off, more than the {:.1f} mm it promises, {:.3f} s after the begin",
                           std::holds_alternative<wire::Birds>(each.event) ? "TDATA" : "a frame's pose", pose->off_mm,
                           pose->bound_mm, seconds(pose->acquired.ns - span.begin_ns)));
    }
  }
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (shown[i]) continue;
    said.erase(std::unique(said.begin(), said.end()), said.end());
    if (before) said.insert(said.begin(), "before: " + nlohmann::json(*before).dump());
    complain(fmt::format("never seen: {}; said was:\n    {}", words_of(fault.signs[i]), fmt::join(said, "\n    ")));
  }
  const auto frames = recovery_s(seen, span.end_ns, until_ns, false);
  const auto tracking = recovery_s(seen, span.end_ns, until_ns, true);
  if (frames && tracking) row.recovery_s = std::max(0.0, std::max(*frames, *tracking) - fault.own_s);
  if (!row.recovery_s || *row.recovery_s > kRecoversWithinS) {
    row.slow.push_back(row.fault + fmt::format(": not good again within {:.1f} s: frames {}, tracking {}",
                                               seconds(until_ns - span.end_ns), frames.value_or(-1),
                                               tracking.value_or(-1)));
  }
  const double expected =
      (of_tracker ? FaultRig::kFrameRateHz : FaultRig::kTrackerRateHz) * seconds(until_ns - span.begin_ns);
  row.others_percent = std::min(100.0, 100 * others / expected);
  if (*row.others_percent < 90) {
    row.slow.push_back(row.fault +
                       fmt::format(": of the other instrument only {} of {:.0f} came meanwhile", others, expected));
  }
  return row;
}

}  // namespace birdseye::testing
