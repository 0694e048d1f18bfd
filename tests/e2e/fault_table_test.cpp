// Every fault that the simulated instruments know, and those of the appliance's own side, against the real birdseyed.
// The table goes to docs/manual/faults.md: BIRDSEYE_FAULTS_PAGE=FILE writes it there, else the file is held against it.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <thread>

#include "hw-sim/faults/fault_table.hpp"
#include "tests/e2e/appliance_faults.hpp"
#include "tests/e2e/fault_judge.hpp"
#include "tests/e2e/fault_page.hpp"
#include "tests/support/page_table.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::testing {
namespace {

using Where = Sign::Where;

const Sign kPhaseErrors{Where::counter, "phase_errors"};
const Sign kDoubted{Where::counter, "doubted"};
const Sign kFramesLost{Where::counter, "frames_dropped"};
const Sign kClockEvents{Where::counter, "clock_events"};

Sign status(const std::string& words) {
  return {Where::status, words};
}
Sign doubt(const std::string& words) {
  return {Where::doubt, words};
}

std::vector<FaultCase> of_the_line() {
  return {
      {.name = "drop_byte", .parameters = "chance = 0.3", .signs = {kPhaseErrors}},
      {.name = "duplicate_byte", .parameters = "chance = 0.3", .signs = {kPhaseErrors}},
      {.name = "corrupt_byte",
       .parameters = "chance = 0.3",
       .signs = {kDoubted},
       .note = "A change that a moving hand might have made (up to 10 mm) is not told from one",
       .extra_mm = 10},
      {.name = "wrong_phase_bit", .parameters = "chance = 0.3", .signs = {kPhaseErrors}},
      {.name = "line_noise", .parameters = "chance = 0.3", .signs = {kPhaseErrors}},
      {.name = "wrong_phase_bit",
       .parameters = "chance = 1",
       .for_s = 2,
       .calm_s = 4,
       .signs = {status("sends no whole record")},
       .note = "As at another baud rate; the unit is stopped and started"},
      {.name = "lost_record",
       .parameters = "chance = 0.3",
       .calm_s = 4,
       .signs = {kClockEvents},
       .note = "Health `measurements_lost` too, where the times tell how many"},
  };
}

std::vector<FaultCase> of_the_unit() {
  return {
      {.name = "zero_matrix", .signs = {doubt("sensor saturated"), status("scope: sensor saturated")}},
      {.name = "saturated", .signs = {doubt("sensor saturated"), status("scope: sensor saturated")}},
      {.name = "frozen_pose", .signs = {doubt("frozen"), status("scope: frozen")}},
      {.name = "hemisphere_flip", .signs = {doubt("hemisphere flip"), status("scope: hemisphere flip")}},
      {.name = "metal_distortion",
       .parameters = "peak_mm = 10",
       .note = "**Not seen**: one sensor cannot tell a bent field from a movement",
       .poses_lie = true},
      {.name = "stuck_stream", .for_s = 1, .calm_s = 5, .signs = {status("fallen silent")}},
  };
}

std::vector<FaultCase> of_its_supply() {
  return {
      {.name = "unplug", .for_s = 1, .calm_s = 7, .signs = {status("no such device; is the tracker plugged in")}},
      {.name = "power_cycle",
       .parameters = "boot_s = 0.5",
       .calm_s = 8,
       .signs = {status("fallen silent")},
       .own_s = 0.5},
  };
}

std::vector<FaultCase> of_its_clock() {
  return {
      {.name = "clock_step",
       .parameters = "ms = 20",
       .for_s = 5,
       .calm_s = 4,
       .signs = {kClockEvents},
       .note = "While the unit's delay is longer than `delay_ms` says, times are late by that",
       .extra_time_s = 0.02},
      {.name = "drift_step", .parameters = "ppm = 2000", .for_s = 5, .calm_s = 4, .signs = {kClockEvents}},
  };
}

std::vector<FaultCase> of_the_camera() {
  const auto late = [](const wire::VideoFrame& frame) {
    return (frame.info.arrived - frame.info.acquired) > Duration::from_ms(38);
  };
  const auto small = [](const wire::VideoFrame& frame) { return frame.width_px == 80 && frame.height_px == 64; };
  return {
      {.name = "drop_frames", .parameters = "chance = 0.3", .signs = {kFramesLost}},
      {.name = "sequence_gap", .parameters = "chance = 0.3, frames = 5", .signs = {kFramesLost}},
      {.name = "late_frames",
       .parameters = "ms = 30",
       .signs = {{Where::frame, "FrameInfo: `arrived_ns` is as much later than `acquired_ns`", late}}},
      {.name = "duplicate_frames", .parameters = "chance = 0.5", .signs = {{Where::counter, "frames_repeated"}}},
      {.name = "size_change", .signs = {{Where::frame, "IMAGE of the new size", small}}},
      {.name = "silence", .for_s = 1, .calm_s = 3, .signs = {status("the camera sends no frames")}},
      {.name = "clock_step",
       .parameters = "ms = 20",
       .for_s = 2,
       .calm_s = 3,
       .signs = {kClockEvents},
       .note = "The pose is that of the time that is stamped, so the picture is off by the step: stamps are believed"},
  };
}

std::vector<FaultCase> of_its_plug() {
  return {
      {.name = "garbage", .parameters = "chance = 0.1", .calm_s = 4, .signs = {status("what it sends is not a frame")}},
      {.name = "torn_frame",
       .parameters = "chance = 0.1",
       .calm_s = 4,
       .signs = {status("what it sends is not a frame")},
       .note = "The picture that is torn goes out: a socket's frame carries no checksum"},
      {.name = "unplug",
       .for_s = 1,
       .calm_s = 4,
       .signs = {status("the camera has gone"), status("no camera listens there")}},
  };
}

/// One birdseyed, one instrument's faults one after another.
struct Round {
  bool of_tracker = true;
  std::vector<FaultCase> cases;
  double first_s = 3;
  std::vector<FaultRow> rows = {};
  std::vector<std::vector<std::string>> problems = {};  ///< by case
  std::vector<bool> still;                              ///< the machine was, about the case

  explicit Round(bool tracker, std::vector<FaultCase> faults, double first = 3)
      : of_tracker(tracker),
        cases(std::move(faults)),
        first_s(first),
        rows(cases.size()),
        problems(cases.size()),
        still(cases.size()) {}

  void go(const std::filesystem::path& folder) {
    FaultRig::Settings settings{.folder = folder};
    (of_tracker ? settings.tracker_faults : settings.camera_faults) =
        script_of(cases, first_s, of_tracker ? "tracker" : "camera");
    FaultRig rig(settings);
    rig.listen(90, [&] { return rig.faults().size() == cases.size(); });
    rig.listen(cases.back().calm_s);
    const auto spans = rig.faults();
    const auto zero_ns = rig.circle_zero_ns();
    for (std::size_t i = 0; i < cases.size(); ++i) {
      if (i >= spans.size()) {
        problems[i].push_back(cases[i].name + ": never befell. " + rig.failure() + rig.log());
        continue;
      }
      const std::int64_t until_ns = spans[i].end_ns + static_cast<std::int64_t>(cases[i].calm_s * 1e9);
      rows[i] = judge(cases[i], spans[i], until_ns, of_tracker, zero_ns, rig.seen(), problems[i]);
      still[i] = stood_still(rig.seen(), spans[i], until_ns, of_tracker);
    }
    if (std::getenv("BIRDSEYE_FAULTS_LOG") != nullptr) std::fprintf(stderr, "%s\n", rig.log().c_str());
  }

  /// What did not come out well fails, but for where the machine stood still: that is told, and .ci/run counts it.
  void complain() const {
    for (std::size_t i = 0; i < cases.size(); ++i) {
      std::vector<std::string> all = problems[i];
      all.insert(all.end(), rows[i].slow.begin(), rows[i].slow.end());
      for (const std::string& problem : all) {
        EXPECT_TRUE(still[i]) << problem;
        if (still[i]) {
          std::printf("not judged, the machine stood still: %s\n", problem.substr(0, problem.find('\n')).c_str());
        }
      }
    }
  }
};

/// Every kind of fault that there is has its row.
void expect_complete(const std::vector<Round>& rounds) {
  std::set<std::pair<bool, std::string>> have;
  for (const Round& round : rounds) {
    for (const FaultCase& fault : round.cases) have.emplace(round.of_tracker, fault.name);
  }
  for (const hw_sim::FaultSpec& spec : hw_sim::fault_table()) {
    const std::string name(hw_sim::fault_name(spec.kind));
    EXPECT_TRUE(!spec.of_tracker || have.count({true, name}) == 1) << "tracker " << name;
    EXPECT_TRUE(!spec.of_camera || have.count({false, name}) == 1) << "camera " << name;
  }
}

/// Writes the page's table, or holds it against what is there.
void settle(const std::string& name, const std::vector<FaultRow>& rows) {
  settle_table("faults.md", "BIRDSEYE_FAULTS_PAGE", "./run faults", name, table_lines(rows), unmeasured);
}

TEST(FaultTable, TheInstrumentsFaultsAreNamedDoNotLieAndPass) {
  const Scratch scratch;
  std::vector<Round> rounds{Round(true, of_the_line()),     Round(true, of_the_unit()),    Round(true, of_its_supply()),
                            Round(true, of_its_clock(), 6), Round(false, of_the_camera()), Round(false, of_its_plug())};
  expect_complete(rounds);
  {
    std::vector<std::jthread> threads;
    threads.reserve(rounds.size());
    for (std::size_t i = 0; i < rounds.size(); ++i)
      threads.emplace_back([&, i] { rounds[i].go(scratch / fmt::format("rig{}", i)); });
  }
  std::vector<FaultRow> tracker, camera;
  for (const Round& round : rounds) {
    auto& table = round.of_tracker ? tracker : camera;
    table.insert(table.end(), round.rows.begin(), round.rows.end());
    round.complain();
  }
  settle("tracker", tracker);
  settle("camera", camera);
}

TEST(FaultTable, TheApplianceGoesOnBesideItsOwn) {
  const Scratch scratch;
  const auto faults = appliance_faults();
  std::vector<FaultRow> rows(faults.size());
  std::vector<std::vector<std::string>> problems(faults.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < faults.size(); ++i) {
      threads.emplace_back([&, i] {
        rows[i] = faults[i].befall(scratch / fmt::format("own{}", i), problems[i]);
        rows[i].fault = faults[i].name;
        rows[i].how = faults[i].how;
      });
    }
  }
  for (std::size_t i = 0; i < faults.size(); ++i) {
    for (const std::string& problem : problems[i]) ADD_FAILURE() << faults[i].name << ": " << problem;
  }
  settle("appliance", rows);
}

}  // namespace
}  // namespace birdseye::testing
