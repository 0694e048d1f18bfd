// What is said of a latency to whoever set up the appliance, above all where something is taken off twice.
#include "host/calibrate/latency_advice.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "calibration/latency/latency.hpp"
#include "device/wire/messages.hpp"
#include "drivers/system/progress.hpp"
#include "host/calibrate/latency_streams.hpp"
#include "host/link/event_source.hpp"

namespace birdseye::host {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

/// Found to 0.5 ms.
calibration::Latency late_by(double ms) {
  calibration::Latency out;
  out.determined = true;
  out.offset_ms = ms;
  out.offset_ci95_ms = {ms - 0.5, ms + 0.5};
  return out;
}

Verdict verdict_of(double late_ms, const LatencySetting& setting) {
  Verdict verdict;
  judge_in_force(late_by(late_ms), setting, verdict);
  return verdict;
}

TEST(LatencyAdvice, WithoutARecordNamesTheDelay) {
  const LatencyAdvice late = advise_latency(late_by(83.3), {10.0, std::nullopt, false});
  EXPECT_THAT(late.text, HasSubstr("83.3 ms too late"));
  EXPECT_THAT(late.text, HasSubstr("set [camera] delay_ms to 93.3"));
  ASSERT_TRUE(late.camera_delay_ms);
  EXPECT_NEAR(*late.camera_delay_ms, 93.3, 1e-9);
  EXPECT_THAT(advise_latency(late_by(83.3), {}).text, HasSubstr("raise [camera] delay_ms by 83.3"));
  EXPECT_THAT(advise_latency(late_by(-3), {}).text, HasSubstr("lower [camera] delay_ms by 3.0"));
  const LatencyAdvice agrees = advise_latency(late_by(0.2), {10.0, std::nullopt, false});
  EXPECT_THAT(agrees.text, HasSubstr("leave delay_ms as it is"));
  EXPECT_EQ(agrees.camera_delay_ms, 10.0);
}

TEST(LatencyAdvice, NamesNoKeyThatWouldBeBelowZero) {
  // The tracker's is some 7 ms at first: less by 83 ms is refused by birdseyed.
  const std::string late = advise_latency(late_by(83.3), {0.0, std::nullopt, false}).text;
  EXPECT_THAT(late, Not(HasSubstr("[tracker]")));
  EXPECT_THAT(late,
              HasSubstr("where the camera stamps its frames itself, enter it into the scope's record (--record)"));
  EXPECT_THAT(advise_latency(late_by(-20), {30.0, std::nullopt, false}).text,
              HasSubstr("raise [tracker] delay_ms by 20.0"));
  const LatencyAdvice early = advise_latency(late_by(-20), {5.0, std::nullopt, false});
  EXPECT_THAT(early.text, HasSubstr("cannot be lowered by as much: raise [tracker] delay_ms by 20.0"));
  EXPECT_FALSE(early.camera_delay_ms);
}

TEST(LatencyAdvice, IntoARecordLeavesTheDelayAlone) {
  const LatencyAdvice advice = advise_latency(late_by(83.3), {0.0, std::nullopt, true});
  EXPECT_THAT(advice.text, HasSubstr("83.3 ms too late"));
  EXPECT_THAT(advice.text, HasSubstr("takes that off by itself"));
  EXPECT_THAT(advice.text, HasSubstr("leave delay_ms as it is, 0"));
  EXPECT_THAT(advice.text, Not(HasSubstr("set [camera] delay_ms")));
  EXPECT_FALSE(advice.camera_delay_ms);
}

TEST(LatencyAdvice, ARecordInForceThatFitsIsWell) {
  const LatencySetting setting{std::nullopt, 83.25, false};
  EXPECT_THAT(advise_latency(late_by(83.4), setting).text,
              HasSubstr("takes 83.2 ms off the frames' times by its calibration record; so they agree"));
  const Verdict verdict = verdict_of(83.4, setting);
  EXPECT_EQ(verdict.grade, Grade::pass);
  EXPECT_THAT(verdict.reasons, Contains(HasSubstr("by the calibration record in force")));
}

TEST(LatencyAdvice, WhatIsTakenOffTwiceIsTold) {
  // delay_ms takes all of it, and the record 83.25 ms more.
  const LatencySetting setting{83.1, 83.25, false};
  const LatencyAdvice advice = advise_latency(late_by(0.24), setting);
  EXPECT_THAT(advice.text, HasSubstr("83.0 ms too early"));
  EXPECT_THAT(advice.text, Not(HasSubstr("leave delay_ms as it is")));
  EXPECT_THAT(advice.text, HasSubstr("set delay_ms back"));
  EXPECT_FALSE(advice.camera_delay_ms);
  const Verdict verdict = verdict_of(0.24, setting);
  EXPECT_EQ(verdict.grade, Grade::marginal);
  EXPECT_THAT(verdict.reasons, Contains(HasSubstr("with it they are 83.0 ms too early")));
  EXPECT_THAT(verdict.next_steps, Contains(HasSubstr("--record")));
  // Who measures it anew into the record has done what there is to do, and the entry is as good as any.
  const LatencySetting anew{83.1, 83.25, true};
  EXPECT_EQ(verdict_of(0.24, anew).grade, Grade::pass);
  EXPECT_THAT(advise_latency(late_by(0.24), anew).text, HasSubstr("until it uses the record that is written now"));
}

class Events : public EventSource {
 public:
  void add(wire::Event event) { events_.push_back(std::move(event)); }
  Result<std::optional<wire::Event>> next(Deadline /*deadline*/) override {
    if (events_.empty()) return Error{Errc::disconnected, "the end"};
    std::optional<wire::Event> out = std::move(events_.front());
    events_.pop_front();
    return out;
  }

 private:
  std::deque<wire::Event> events_;
};

wire::VideoFrame frame_at(double ms, std::optional<Duration> latency) {
  wire::VideoFrame frame;
  frame.info.acquired.ns = static_cast<std::int64_t>(1e6 * ms);
  frame.info.latency = latency;
  frame.width_px = 64;
  frame.height_px = 48;
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3 * 64 * 48);
  return frame;
}

TEST(LatencyStreams, KeepWhatARecordTakesOffTheFramesTimes) {
  const auto streams_of = [](std::optional<Duration> latency) {
    Events events;
    events.add(wire::Birds{DeviceTime{}, {{"scope", {}}}});
    events.add(frame_at(20, std::nullopt));  // before the instruments were known to be the record's
    events.add(frame_at(60, latency));
    Progress progress;
    return gather_events(events, {"scope", 0}, progress);
  };
  const auto with = streams_of(Duration::from_ms(83)), without = streams_of(std::nullopt);
  ASSERT_TRUE(with && without);
  ASSERT_TRUE(with->in_force_ms);
  EXPECT_NEAR(*with->in_force_ms, 83, 1e-9);
  EXPECT_FALSE(without->in_force_ms);
}

}  // namespace
}  // namespace birdseye::host
