#include "device/birdseyed/frame_clock.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace birdseye::device {
namespace {

constexpr double kPeriod_s = 1.0 / 60;
constexpr double kExposure_s = 0.008;
constexpr double kDelay_s = 0.041;  // from the middle of the exposure: two periods and a half

DeviceTime at_seconds(double seconds) {
  return {1'000'000'000'000 + std::llround(seconds * 1e9)};
}

/// A camera that is on already when its frames are first looked at, with a strobe line.
struct Camera {
  std::mt19937 rng{5};
  std::optional<double> stamp_error_s;  ///< stamps, off by so much; else none
  int paired = 0, refused = 0, by_arrival = 0;
  double worst_s = 0;  ///< of the frames that are said to be known
  std::string reason;

  void film(FrameClock& clock, int frames) {
    std::uniform_real_distribution<double> late(0, 0.002);
    int edges = 0;
    for (int n = 20; n < frames; ++n) {
      const double middle_s = n * kPeriod_s;
      drivers::Frame frame;
      frame.sequence = static_cast<std::uint64_t>(n);
      frame.arrived = at_seconds(middle_s + kDelay_s + late(rng));
      if (stamp_error_s) {
        frame.acquired = at_seconds(middle_s + *stamp_error_s);
        frame.acquired_sigma = Duration::from_ms(3);
        frame.acquired_known = true;
      }
      for (; at_seconds(edges * kPeriod_s - kExposure_s / 2) < frame.arrived; ++edges)
        clock.take({drivers::GpioInput::strobe, true, at_seconds(edges * kPeriod_s - kExposure_s / 2)});
      const auto time = clock.time_of(frame);
      if (!time.certain) {
        ++refused;
        reason = time.reason;
        continue;
      }
      ++(time.sigma < Duration::from_ms(1) && time.sigma < kWakeSigma ? paired : by_arrival);
      worst_s = std::max(worst_s, std::abs((time.acquired - at_seconds(middle_s)).seconds()));
    }
  }
};

FrameClock::Settings with_strobe(std::optional<Duration> delay) {
  return {.rate_hz = 60, .delay = delay, .exposure = Duration::from_seconds(kExposure_s), .strobe = true};
}

TEST(FrameClock, ADelayRightToAThirdOfAPeriodTellsWhichEdgeIsAFrames) {
  for (const double off_s : {-kPeriod_s / 3, 0.0, kPeriod_s / 3}) {
    FrameClock clock(with_strobe(Duration::from_seconds(kDelay_s + off_s)));
    Camera camera;
    camera.film(clock, 300);
    EXPECT_GT(camera.paired, 260) << off_s;
    EXPECT_LT(camera.refused, 12) << camera.reason;  // while the line begins
    // Before it is learnt, the delay is believed.
    EXPECT_LT(camera.worst_s, std::abs(off_s) + 0.003);
  }
}

TEST(FrameClock, StampsTellWhichEdgeIsAFrames) {
  for (const double off_s : {-0.004, 0.0, 0.006}) {
    FrameClock clock(with_strobe({}));
    Camera camera;
    camera.stamp_error_s = off_s;
    camera.film(clock, 300);
    EXPECT_GT(camera.paired, 260) << off_s;
    EXPECT_LE(camera.worst_s, std::abs(off_s) + 1e-6);
  }
}

TEST(FrameClock, SpuriousEdgesOfTheStrobeAreCountedAcrossRestarts) {
  FrameClock clock(with_strobe(Duration::from_seconds(kDelay_s)));
  Camera().film(clock, 100);
  EXPECT_EQ(clock.spurious_strobe_edges(), 0U);
  const auto edge = [&](double seconds) { clock.take({drivers::GpioInput::strobe, true, at_seconds(seconds)}); };
  edge(5);
  edge(5.003);
  EXPECT_EQ(clock.spurious_strobe_edges(), 1U);
  clock.restart(60, {});
  EXPECT_EQ(clock.spurious_strobe_edges(), 1U);
  Camera().film(clock, 100);
  edge(5);
  edge(5.003);
  EXPECT_EQ(clock.spurious_strobe_edges(), 2U);
}

TEST(FrameClock, AStrobeAloneIsNoTimeWhereFramesMayBeAnyEdges) {
  FrameClock clock(with_strobe({}));
  Camera camera;
  camera.film(clock, 300);
  EXPECT_EQ(camera.paired + camera.by_arrival, 0);
  EXPECT_NE(camera.reason.find("differ by a period"), std::string::npos) << camera.reason;
  EXPECT_NE(camera.reason.find("delay_ms"), std::string::npos) << camera.reason;
}

TEST(FrameClock, FramesWithoutAnythingHaveTheTimesOfTheirLine) {
  FrameClock clock({.rate_hz = 60, .delay = Duration::from_seconds(kDelay_s)});
  Camera camera;
  camera.film(clock, 300);
  EXPECT_EQ(camera.paired, 0);
  EXPECT_GT(camera.by_arrival, 250);
  EXPECT_LT(camera.worst_s, 0.003);
}

}  // namespace
}  // namespace birdseye::device
