#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <random>

#include "hw-sim/faults/fault_script.hpp"
#include "hw-sim/faults/fault_table.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::hw_sim {
namespace {

using testing::Scratch;

std::string problem(const std::string& text, Instruments instruments = Instruments::both) {
  const Scratch scratch;
  const auto script = read_fault_script(scratch.file("f.toml", text), instruments, 1);
  return script ? "" : script.error().what;
}

TEST(FaultScript, GivesEachInstrumentItsFaultsInTheirOrder) {
  const Scratch scratch;
  const auto script = read_fault_script(scratch.file("f.toml", R"(
[[fault]]
name = "drop_byte"
at_s = 3
for_s = 0.5
chance = 0.25
[[fault]]
name = "saturated"
at_s = 2.0
for_s = 1
[[fault]]
name = "unplug"
of = "camera"
at_s = 1
for_s = 0.1
)"),
                                        Instruments::both, 1);
  ASSERT_TRUE(script) << script.error().what;
  ASSERT_EQ(script->tracker.size(), 2U);
  EXPECT_EQ(script->tracker[0].kind, FaultKind::saturated);
  EXPECT_EQ(script->tracker[1].kind, FaultKind::drop_byte);
  EXPECT_DOUBLE_EQ(script->tracker[1].value("chance"), 0.25);
  ASSERT_EQ(script->camera.size(), 1U);
  EXPECT_EQ(script->camera[0].kind, FaultKind::unplug);
}

TEST(FaultScript, EverythingWrongIsToldWithItsLine) {
  const std::string all = problem(R"([[fault]]
name = "drop_bytes"
at_s = 1

[[fault]]
name = "drop_byte"
at_s = -1
chance = "often"

[[fault]]
name = "stuck_stream"
at_s = 1
reason = "none"

[[fault]]
name = "clock_step"
at_s = 1
)");
  for (const char* words :
       {"line 2: \"drop_bytes\"", "line 7: at_s", "line 8: chance", "line 10: stuck_stream: needs for_s",
        "line 13: reason", "line 15: clock_step: either instrument"}) {
    EXPECT_NE(all.find(words), std::string::npos) << words << "\n" << all;
  }
}

/// What is over before anybody could tell it, and what strikes nothing.
TEST(FaultScript, RefusesWhatNobodyCouldTell) {
  const auto with = [](const std::string& name, const std::string& more) {
    return problem("[[fault]]\nname = \"" + name + "\"\nat_s = 15\n" + more, Instruments::with_programs);
  };
  for (const char* const name :
       {"appliance_restart", "window_restart", "scope_exchanged", "appliance_power_cut", "power_cut", "size_change"}) {
    EXPECT_NE(with(name, "for_s = 0.09\n").find("line 4: for_s: needs a number of 0.1"), std::string::npos) << name;
    EXPECT_EQ(with(name, "for_s = 0.1\n"), "");
  }
  EXPECT_NE(with("silence", "for_s = 0.3\n").find("for_s: needs a number of 0.5"), std::string::npos);
  EXPECT_EQ(with("silence", "for_s = 0.5\n"), "");
  for (const char* const name : {"drop_byte", "lost_record", "drop_frames", "sequence_gap", "garbage", "torn_frame"}) {
    EXPECT_NE(with(name, "for_s = 1\nchance = 0\n").find("chance: needs a number of 0.001 to 1"), std::string::npos)
        << name;
  }
  EXPECT_NE(with("appliance_disk_late", "for_s = 5\nms = 3255\n").find("ms: needs a number of 0 to 1000"),
            std::string::npos);
}

TEST(FaultScript, RefusesTimesWhereItSaysWhenAFaultBefalls) {
  const std::string why = problem("[[fault]]\nname = \"drop_byte\"\nat_s = 1\ntimes = 5\n");
  EXPECT_NE(why.find("line 4: times: goes with between_s"), std::string::npos) << why;
  EXPECT_EQ(problem("[[fault]]\nname = \"drop_byte\"\nbetween_s = [1, 2]\ntimes = 5\n"), "");
}

TEST(FaultScript, OfANameThatThereIsNotItNamesThoseThatAreAlike) {
  const std::string why = problem("[[fault]]\nname = \"transmiter_bump\"\nat_s = 1\n");
  EXPECT_NE(why.find("no such fault; alike are transmitter_bumped"), std::string::npos) << why;
  EXPECT_LT(why.size(), 250U) << why;
}

TEST(FaultScript, RefusesWhatIsNoScript) {
  EXPECT_NE(problem("[[fault]\n").find("line 1"), std::string::npos);
  EXPECT_NE(problem("rate = 1\n").find("line 1: rate"), std::string::npos);
  EXPECT_NE(problem("fault = 3\n").find("line 1: fault"), std::string::npos);
  EXPECT_NE(problem("fault = [1]\n").find("line 1"), std::string::npos);
  const std::string camera_fault = "[[fault]]\nname = \"silence\"\nat_s = 1\nfor_s = 1\n";
  EXPECT_NE(problem(camera_fault, Instruments::tracker).find("no instrument"), std::string::npos);
  EXPECT_EQ(problem(camera_fault, Instruments::camera), "");
  EXPECT_EQ(read_fault_script("/nonexistent", Instruments::both, 1).error().code, Errc::not_found);
  EXPECT_NE(problem(std::string(5U << 20U, '#')).find("larger than"), std::string::npos);
}

TEST(FaultScript, GivesTheOperationWhatBefallsItOnlyInACart) {
  const std::string text = "[[fault]]\nname = \"bed_tilted\"\nat_s = 4\ndeg = 5\n";
  const Scratch scratch;
  const auto script = read_fault_script(scratch.file("f.toml", text), Instruments::both, 1);
  ASSERT_TRUE(script) << script.error().what;
  EXPECT_TRUE(script->tracker.empty() && script->camera.empty());
  ASSERT_EQ(script->world.size(), 1U);
  EXPECT_DOUBLE_EQ(script->world[0].value("deg"), 5);
  EXPECT_DOUBLE_EQ(script->world[0].value("over_s"), 3);
  for (const Instruments alone : {Instruments::tracker, Instruments::camera})
    EXPECT_NE(problem(text, alone).find("line 1: bed_tilted: befalls the operation"), std::string::npos);
  EXPECT_NE(problem(text + "of = \"tracker\"\n").find("without of"), std::string::npos);
}

TEST(FaultScript, TimesDrawnAtRandomFollowFromTheSeed) {
  const Scratch scratch;
  const auto times = [&](std::uint64_t seed) {
    const auto script =
        read_fault_script(scratch.file("f.toml", "[[fault]]\nname = \"drop_byte\"\nbetween_s = [2, 20]\ntimes = 8\n"),
                          Instruments::tracker, seed);
    std::vector<double> at_s;
    for (const Fault& fault : script->tracker) at_s.push_back(fault.at_s);
    return at_s;
  };
  ASSERT_EQ(times(1).size(), 8U);
  EXPECT_EQ(times(1), times(1));
  EXPECT_NE(times(1), times(2));
  for (const double at_s : times(1)) {
    EXPECT_GE(at_s, 2);
    EXPECT_LE(at_s, 20);
  }
}

TEST(FaultTable, HasEveryKindOnce) {
  for (int kind = 0; kind <= static_cast<int>(FaultKind::appliance_disk_full); ++kind) {
    const FaultSpec* const spec = fault_spec(fault_name(static_cast<FaultKind>(kind)));
    ASSERT_NE(spec, nullptr) << fault_name(static_cast<FaultKind>(kind));
    EXPECT_EQ(static_cast<int>(spec->kind), kind);
  }
  EXPECT_EQ(fault_table().size(), static_cast<std::size_t>(FaultKind::appliance_disk_full) + 1);
}

TEST(FaultTimeline, BeginsEndsAndTellsOfIt) {
  Fault lasting;
  lasting.kind = FaultKind::saturated;
  lasting.at_s = 1;
  lasting.for_s = 0.5;
  Fault once;
  once.kind = FaultKind::drop_byte;
  once.at_s = 1.2;
  FaultTimeline timeline({once, lasting}, FaultTarget::tracker);
  timeline.advance(5'000'000'000);
  EXPECT_TRUE(timeline.take_events().empty());  // nothing streams yet
  timeline.begin(5'000'000'000);
  EXPECT_EQ(*timeline.next_change_ns(), 6'000'000'000);
  timeline.advance(6'300'000'000);
  EXPECT_NE(timeline.active(FaultKind::saturated), nullptr);
  timeline.done(FaultKind::drop_byte, 6'310'000'000);
  EXPECT_EQ(timeline.active(FaultKind::drop_byte), nullptr);
  timeline.advance(7'000'000'000);
  EXPECT_EQ(timeline.active(FaultKind::saturated), nullptr);
  EXPECT_FALSE(timeline.next_change_ns());
  const auto events = timeline.take_events();
  ASSERT_EQ(events.size(), 4U);
  EXPECT_EQ(events[0].at_ns, 6'000'000'000);
  EXPECT_EQ(events[1].at_ns, 6'200'000'000);
  EXPECT_FALSE(events[2].begin);
  EXPECT_EQ(events[3].kind, FaultKind::saturated);
  EXPECT_EQ(events[3].at_ns, 6'500'000'000);
}

/// Held against all of the script at each step: short faults among long ones, several of a kind, some at one time.
TEST(FaultTimeline, HoldsWhatTheScriptSaysHoweverManyThereAre) {
  std::mt19937_64 random(7);
  const auto up_to = [&random](std::uint64_t count) { return static_cast<std::int64_t>(random() % count); };
  constexpr std::array kKinds{FaultKind::saturated, FaultKind::unplug, FaultKind::silence};
  std::vector<Fault> script(200);
  for (Fault& fault : script) {
    fault.kind = kKinds.at(static_cast<std::size_t>(up_to(kKinds.size())));
    fault.at_s = static_cast<double>(up_to(600));
    fault.for_s = static_cast<double>(1 + (up_to(10) == 0 ? up_to(100) : up_to(4)));
  }
  FaultTimeline timeline(script, FaultTarget::tracker);
  timeline.begin(0);
  std::ranges::stable_sort(script, {}, &Fault::at_s);
  std::size_t told = 0;
  for (std::int64_t now_s = 0; now_s < 800; now_s += up_to(4)) {
    timeline.advance(now_s * 1'000'000'000);
    told += timeline.take_events().size();
    const auto now = static_cast<double>(now_s);
    std::size_t changes = 0;
    std::optional<double> next_s;
    for (const Fault& fault : script) {
      for (const double change_s : {fault.at_s, fault.at_s + *fault.for_s}) {
        if (change_s <= now) ++changes;
        if (change_s > now) next_s = std::min(next_s.value_or(change_s), change_s);
      }
    }
    EXPECT_EQ(told, changes) << now_s;
    EXPECT_EQ(timeline.next_change_ns().value_or(-1), next_s ? std::llround(*next_s * 1e9) : -1) << now_s;
    for (const FaultKind kind : kKinds) {
      const auto holds = std::ranges::find_if(script, [&](const Fault& fault) {
        return fault.kind == kind && fault.at_s <= now && now < fault.at_s + *fault.for_s;
      });
      const Fault* const active = timeline.active(kind);
      const auto ends_s = [](const Fault& fault) { return fault.at_s + *fault.for_s; };
      EXPECT_EQ(active != nullptr ? ends_s(*active) : -1, holds != script.end() ? ends_s(*holds) : -1) << now_s;
    }
  }
}

}  // namespace
}  // namespace birdseye::hw_sim
