// Every fault that the simulated instruments know, injected while the real `birdseye live` runs, and judged by the
// pixels on the screen: no overlay older than 150 ms, none in a wrong place, no picture passed off as live that has
// stopped.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <set>
#include <utility>

#include "hw-sim/faults/fault_table.hpp"
#include "tests/e2e/fault_judge.hpp"
#include "tests/e2e/window_rig.hpp"

namespace birdseye::testing {
namespace {

constexpr double kMostAgeMs = 150;
constexpr double kStillMs = 60;     // between two looks; usually 12
constexpr double kMostOffMm = 8;    // what the overlay refuses of a registration; the scope moves at 628 mm/s
constexpr double kStoppedMs = 450;  // by then a picture that has stopped has lost its colours

/// A fault, and what must become of the picture.
struct WindowFault {
  FaultCase fault;
  std::string gone_with = {};  ///< 150 ms into it no overlay may be left, and the window says so; empty: it may stay
  double extra_mm = 0;         ///< by which the overlay may be off: what nobody can see
};

WindowFault of(const std::string& name, const std::string& parameters, double for_s, double calm_s,
               const std::string& gone_with = "", double extra_mm = 0) {
  WindowFault out;
  out.fault.name = name;
  out.fault.parameters = parameters;
  out.fault.for_s = for_s;
  out.fault.calm_s = calm_s;
  out.gone_with = gone_with;
  out.extra_mm = extra_mm;
  return out;
}

const std::string kOldPose = "the newest pose is", kStopped = "the video has stopped";

std::vector<WindowFault> of_the_tracker() {
  return {of("drop_byte", "chance = 0.3", 0.5, 1.5),
          of("duplicate_byte", "chance = 0.3", 0.5, 1.5),
          of("corrupt_byte", "chance = 0.3", 0.5, 1.5),
          of("wrong_phase_bit", "chance = 0.3", 0.5, 1.5),
          of("line_noise", "chance = 0.3", 0.5, 1.5),
          of("wrong_phase_bit", "chance = 1", 1, 4, kOldPose),
          of("lost_record", "chance = 0.3", 0.5, 4),
          of("zero_matrix", "", 0.5, 1.5, kOldPose),
          of("saturated", "", 0.5, 1.5, kOldPose),
          of("frozen_pose", "", 0.5, 1.5, kOldPose),
          of("hemisphere_flip", "", 0.5, 1.5, kOldPose),
          of("metal_distortion", "peak_mm = 10", 0.5, 1.5, "", 10),
          of("stuck_stream", "", 1, 4, kOldPose),
          of("unplug", "", 1, 5, kOldPose),
          of("power_cycle", "boot_s = 0.5", 0.5, 5, kOldPose),
          of("clock_step", "ms = 20", 2, 3),
          of("drift_step", "ppm = 2000", 2, 3)};
}

std::vector<WindowFault> of_the_camera() {
  return {of("drop_frames", "chance = 0.3", 0.5, 1.5),
          of("sequence_gap", "chance = 0.3, frames = 5", 0.5, 1.5),
          of("late_frames", "ms = 30", 0.5, 1.5),
          of("duplicate_frames", "chance = 0.5", 0.5, 1.5),
          of("size_change", "", 0.5, 1.5, "the camera was calibrated at 320 x 240"),
          of("silence", "", 1, 3, kStopped),
          of("clock_step", "ms = 20", 1, 3),
          of("garbage", "chance = 0.1", 0.5, 2),
          of("torn_frame", "chance = 0.1", 0.5, 2),
          of("unplug", "", 1, 3, kStopped)};
}

/// Every kind of fault that there is.
void expect_complete(const std::vector<WindowFault>& tracker, const std::vector<WindowFault>& camera) {
  std::set<std::pair<bool, std::string>> have;
  for (const WindowFault& one : tracker) have.emplace(true, one.fault.name);
  for (const WindowFault& one : camera) have.emplace(false, one.fault.name);
  for (const hw_sim::FaultSpec& spec : hw_sim::fault_table()) {
    const std::string name(hw_sim::fault_name(spec.kind));
    EXPECT_TRUE(!spec.of_tracker || have.contains({true, name})) << "tracker " << name;
    EXPECT_TRUE(!spec.of_camera || have.contains({false, name})) << "camera " << name;
  }
}

std::vector<FaultCase> cases_of(const std::vector<WindowFault>& faults) {
  std::vector<FaultCase> out;
  for (const WindowFault& one : faults) out.push_back(one.fault);
  return out;
}

double length_s(const std::vector<WindowFault>& faults) {
  double sum = 0;
  for (const WindowFault& one : faults) sum += one.fault.for_s + one.fault.calm_s;
  return sum;
}

double ms(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-6;
}

/// What was seen from one moment to another.
struct Seeing {
  int glances = 0, overlaid = 0;
  int unread = 0;               ///< overlaid, and which frame it is cannot be read
  int not_judged = 0;           ///< the machine stood still: this test too was not let look
  double oldest_ms = 0;         ///< overlay, since its frame was exposed
  double most_off_mm = 0;       ///< overlay, from where the truth has it
  double last_overlay_ms = -1;  ///< since the first moment
  double passed_off_ms = 0;     ///< the oldest picture that was shown as live
  std::string words;            ///< all that was said
};

Seeing seeing(const WindowRig& rig, const std::vector<Said>& said, std::int64_t from_ns, std::int64_t until_ns) {
  Seeing out;
  std::int64_t last_ns = 0, still_ns = 0;
  for (const Glance& glance : rig.glances()) {
    if (ms(glance.at_ns - std::exchange(last_ns, glance.at_ns)) > kStillMs) still_ns = glance.at_ns;
    if (glance.at_ns < from_ns || glance.at_ns > until_ns) continue;
    const double age_ms = glance.exposure ? ms(glance.at_ns - rig.exposed_ns(*glance.exposure)) : 0;
    if (ms(glance.at_ns - still_ns) < kMostAgeMs && age_ms > kMostAgeMs) {
      ++out.not_judged;
      continue;
    }
    ++out.glances;
    EXPECT_GE(age_ms, 0) << "shown before it was exposed";
    if (!glance.dimmed) out.passed_off_ms = std::max(out.passed_off_ms, age_ms);
    if (glance.overlaid_px == 0) continue;
    ++out.overlaid;
    out.unread += glance.exposure ? 0 : 1;
    out.last_overlay_ms = ms(glance.at_ns - from_ns);
    out.oldest_ms = std::max(out.oldest_ms, age_ms);
    out.most_off_mm = std::max(out.most_off_mm, glance.off_mm.value_or(0));
  }
  for (const Said& one : said) {
    if (one.at_ns >= from_ns && one.at_ns <= until_ns) out.words += one.words + "; ";
  }
  return out;
}

/// Nothing old, wrong or passed off as live was seen, and enough was seen to say so.
void expect_safe(const Seeing& seen, double extra_mm) {
  EXPECT_GT(seen.glances, 15);
  EXPECT_LE(seen.not_judged, seen.glances / 10) << "the machine stood still for too long";
  EXPECT_LE(seen.unread, 1 + seen.overlaid / 20);
  EXPECT_LE(seen.oldest_ms, kMostAgeMs);
  EXPECT_LE(seen.most_off_mm, kMostOffMm + extra_mm);
  EXPECT_LE(seen.passed_off_ms, kStoppedMs);
}

/// 150 ms after the first moment nothing was left, and the window said why.
void expect_gone(const Seeing& seen, const std::string& words) {
  EXPECT_LE(seen.last_overlay_ms, kMostAgeMs);
  EXPECT_NE(seen.words.find(words), std::string::npos) << seen.words;
}

void judge(const WindowFault& fault, const FaultSpan& span, const Seeing& in, const Seeing& after) {
  const int still = in.not_judged + after.not_judged;
  fmt::print(
      "{:18} {:3.1f} s: {:3} of {:3} glances overlaid, the oldest {:3.0f} ms, off {:3.1f} mm; after it {:3} of {:3}, "
      "{:3.0f} ms, {:3.1f} mm{}\n",
      span.name, ms(span.end_ns - span.begin_ns) / 1e3, in.overlaid, in.glances, in.oldest_ms, in.most_off_mm,
      after.overlaid, after.glances, after.oldest_ms, after.most_off_mm,
      still == 0 ? "" : fmt::format("; the machine stood still in {}", still));
  SCOPED_TRACE(span.name + " " + fault.fault.parameters);
  EXPECT_EQ(span.name, fault.fault.name);
  expect_safe(in, fault.extra_mm);
  expect_safe(after, fault.extra_mm);
  EXPECT_GT(after.overlaid, 0) << "it does not come back: " << after.words;
  if (!fault.gone_with.empty()) expect_gone(in, fault.gone_with);
}

/// What the appliance as a whole does, by a signal; the window stays.
void expect_safe_without_appliance(WindowRig& rig, int signal) {
  constexpr double kForS = 1.5;
  const std::int64_t from_ns = monotonic_ns();
  rig.appliance().birdseyed().signal(signal);
  rig.watch(kForS);
  const Seeing seen = seeing(rig, rig.said(), from_ns, monotonic_ns());
  SCOPED_TRACE(signal);
  EXPECT_GT(seen.overlaid, 0) << "there was none that could go";
  expect_safe(seen, 0);
  expect_gone(seen, kStopped);
}

TEST(WindowFaults, NoStaleOrWrongOverlayIsOnTheScreen) {
  constexpr double kFirstS = 14;
  const Scratch scratch;
  const auto tracker = of_the_tracker(), camera = of_the_camera();
  expect_complete(tracker, camera);
  const double camera_first_s = kFirstS + length_s(tracker);
  WindowRig rig(scratch, script_of(cases_of(tracker), kFirstS, "tracker"),
                script_of(cases_of(camera), camera_first_s, "camera"));
  ASSERT_TRUE(rig.shows_overlay_within(kFirstS - 3)) << rig.failure();
  rig.watch(camera_first_s + length_s(camera) - 5);

  auto faults = tracker;
  faults.insert(faults.end(), camera.begin(), camera.end());
  const auto spans = rig.appliance().faults();
  ASSERT_EQ(spans.size(), faults.size()) << rig.failure();
  const auto said = rig.said();
  for (std::size_t i = 0; i < spans.size(); ++i) {
    const auto calm_ns = static_cast<std::int64_t>(faults[i].fault.calm_s * 1e9);
    judge(faults[i], spans[i], seeing(rig, said, spans[i].begin_ns, spans[i].end_ns),
          seeing(rig, said, spans[i].end_ns, spans[i].end_ns + calm_ns));
  }

  // What is registered went to 3D Slicer all the while: the CT, and where it is with each frame that bore it.
  EXPECT_EQ(rig.sent("IMAGE"), 1);
  EXPECT_GT(rig.sent("TRANSFORM"), 1000);

  // The appliance hangs with its connection open, comes back, and dies.
  expect_safe_without_appliance(rig, SIGSTOP);
  rig.appliance().birdseyed().signal(SIGCONT);
  EXPECT_TRUE(rig.shows_overlay_within(15));
  expect_safe_without_appliance(rig, SIGKILL);
  EXPECT_EQ(rig.end(), 0) << rig.failure();
}

}  // namespace
}  // namespace birdseye::testing
