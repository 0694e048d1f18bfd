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

using Problems = std::vector<std::string>;

void hold(bool good, const std::string& problem, Problems& problems) {
  if (!good) problems.push_back(problem);
}

/// Nothing old, wrong or passed off as live was seen, and enough was seen to say so.
void hold_safe(const Seeing& seen, double extra_mm, Problems& problems) {
  hold(seen.glances > 15, fmt::format("seen {} times only", seen.glances), problems);
  hold(seen.not_judged <= seen.glances / 10, fmt::format("{} times not judged", seen.not_judged), problems);
  hold(seen.unread <= 1 + seen.overlaid / 20, fmt::format("{} frames not read", seen.unread), problems);
  hold(seen.oldest_ms <= kMostAgeMs, fmt::format("an overlay {:.0f} ms old", seen.oldest_ms), problems);
  hold(seen.most_off_mm <= kMostOffMm + extra_mm, fmt::format("off by {:.1f} mm", seen.most_off_mm), problems);
  hold(seen.passed_off_ms <= kStoppedMs, fmt::format("live and {:.0f} ms old", seen.passed_off_ms), problems);
}

/// 150 ms after the first moment nothing was left, and the window said why.
void hold_gone(const Seeing& seen, const std::string& words, Problems& problems) {
  hold(seen.last_overlay_ms <= kMostAgeMs, fmt::format("an overlay {:.0f} ms into it", seen.last_overlay_ms), problems);
  hold(seen.words.find(words) != std::string::npos, "it says \"" + seen.words + "\"", problems);
}

/// Was this test itself not let look, or did a core let nobody run? Then a complaint may be of the machine.
bool stood_still(const WindowRig& rig, std::int64_t from_ns, std::int64_t until_ns) {
  constexpr std::int64_t kBeforeNs = 300'000'000;
  std::int64_t last_ns = 0;
  for (const Glance& glance : rig.glances()) {
    const double gap_ms = ms(glance.at_ns - std::exchange(last_ns, glance.at_ns));
    if (glance.at_ns > from_ns - kBeforeNs && glance.at_ns < until_ns + kBeforeNs && gap_ms > kStillMs) return true;
  }
  return rig.cores().stood_still(from_ns, until_ns);
}

/// Complaints fail the test, but for those that may be of the machine: they are told.
void settle(const std::string& name, const Problems& problems, bool still) {
  for (const std::string& problem : problems) {
    if (still) {
      fmt::print("not judged, the machine stood still: {}: {}\n", name, problem);
    } else {
      ADD_FAILURE() << name << ": " << problem;
    }
  }
}

void judge(const WindowFault& fault, const FaultSpan& span, const WindowRig& rig, const std::vector<Said>& said) {
  const std::int64_t until_ns = span.end_ns + static_cast<std::int64_t>(fault.fault.calm_s * 1e9);
  const Seeing in = seeing(rig, said, span.begin_ns, span.end_ns), after = seeing(rig, said, span.end_ns, until_ns);
  fmt::print(
      "{:18} {:3.1f} s: {:3} of {:3} glances overlaid, the oldest {:3.0f} ms, off {:3.1f} mm; after it {:3} of {:3}, "
      "{:3.0f} ms, {:3.1f} mm\n",
      span.name, ms(span.end_ns - span.begin_ns) / 1e3, in.overlaid, in.glances, in.oldest_ms, in.most_off_mm,
      after.overlaid, after.glances, after.oldest_ms, after.most_off_mm);
  Problems problems;
  hold_safe(in, fault.extra_mm, problems);
  hold_safe(after, fault.extra_mm, problems);
  hold(after.overlaid > 0, "it does not come back: " + after.words, problems);
  if (!fault.gone_with.empty()) hold_gone(in, fault.gone_with, problems);
  settle(span.name + " " + fault.fault.parameters, problems, stood_still(rig, span.begin_ns, until_ns));
}

/// What the appliance as a whole does, by a signal; the window stays.
void judge_without_appliance(WindowRig& rig, int signal) {
  constexpr double kForS = 1.5;
  const std::int64_t from_ns = monotonic_ns();
  rig.appliance().birdseyed().signal(signal);
  rig.watch(kForS);
  const Seeing seen = seeing(rig, rig.said(), from_ns, monotonic_ns());
  Problems problems;
  hold(seen.overlaid > 0, "there was no overlay that could go", problems);
  hold_safe(seen, 0, problems);
  hold_gone(seen, kStopped, problems);
  settle(fmt::format("birdseyed, signal {}", signal), problems, stood_still(rig, from_ns, monotonic_ns()));
}

/// Injects them, the tracker's first.
void inject(const std::vector<WindowFault>& tracker, const std::vector<WindowFault>& camera) {
  constexpr double kFirstS = 14;
  const Scratch scratch;
  const double camera_first_s = kFirstS + length_s(tracker);
  WindowRig rig(scratch, script_of(cases_of(tracker), kFirstS, "tracker"),
                script_of(cases_of(camera), camera_first_s, "camera"));
  ASSERT_TRUE(rig.shows_overlay_within(kFirstS - 3)) << rig.failure();
  const std::size_t all = tracker.size() + camera.size();
  const double longest_s = camera_first_s + length_s(camera) + 10;
  for (int s = 0; s < longest_s && rig.appliance().faults().size() < all; ++s) rig.watch(1);
  rig.watch(camera.back().fault.calm_s);
  const auto spans = rig.appliance().faults();
  ASSERT_EQ(spans.size(), all) << rig.failure();
  const auto said = rig.said();
  auto span = spans.begin();
  for (const auto* faults : {&tracker, &camera}) {
    for (const WindowFault& fault : *faults) {
      ASSERT_EQ(span->name, fault.fault.name);
      judge(fault, *span++, rig, said);
    }
  }

  // What is registered went to 3D Slicer all the while: the CT, and where it is with each frame that bore it.
  EXPECT_EQ(rig.sent("IMAGE"), 1);
  EXPECT_GT(rig.sent("TRANSFORM"), 100);

  // The appliance hangs with its connection open, comes back, and dies.
  judge_without_appliance(rig, SIGSTOP);
  rig.appliance().birdseyed().signal(SIGCONT);
  EXPECT_TRUE(rig.shows_overlay_within(15));
  judge_without_appliance(rig, SIGKILL);
  EXPECT_EQ(rig.end(), 0) << rig.failure();
}

TEST(WindowFaults, NoStaleOrWrongOverlayIsOnTheScreen) {
  const auto tracker = of_the_tracker(), camera = of_the_camera();
  expect_complete(tracker, camera);
  inject(tracker, camera);
}

}  // namespace
}  // namespace birdseye::testing
