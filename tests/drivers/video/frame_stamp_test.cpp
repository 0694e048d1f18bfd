#include "drivers/video/frame_stamp.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace birdseye::drivers {
namespace {

constexpr Duration kPeriod = Duration::from_ms(20);
constexpr DeviceTime kStamp{1'000'000'000};

TEST(MidExposure, StartOfAKnownExposure) {
  const auto middle = mid_exposure(kStamp, {true, kPeriod, Duration::from_ms(6), std::nullopt});
  EXPECT_EQ((middle.at - kStamp).ns, 3'000'000);
  EXPECT_LT(middle.sigma.ns, 200'000);
}

TEST(MidExposure, EndOfAKnownExposureAndReadout) {
  const auto middle = mid_exposure(kStamp, {false, kPeriod, Duration::from_ms(6), Duration::from_ms(9)});
  EXPECT_EQ((middle.at - kStamp).ns, -12'000'000);
  EXPECT_LT(middle.sigma.ns, 200'000);
}

/// Cameras of all exposures and readouts: the sigma must be that of the errors that are made.
TEST(MidExposure, SigmaCoversWhatIsUnknown) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> fraction(0, 1);
  for (const bool start : {true, false}) {
    for (const bool exposure_known : {true, false}) {
      double sum = 0;
      double squares = 0;
      double claimed_ns = 0;
      constexpr int kCameras = 20'000;
      for (int i = 0; i < kCameras; ++i) {
        const auto exposure = Duration::from_seconds(kPeriod.seconds() * fraction(random));
        const auto readout = Duration::from_seconds(kPeriod.seconds() * fraction(random));
        StampMeaning meaning{start, kPeriod, std::nullopt, std::nullopt};
        if (exposure_known) meaning.exposure = exposure;
        const DeviceTime stamp = start ? kStamp : kStamp + exposure + readout;
        const auto middle = mid_exposure(stamp, meaning);
        const std::int64_t half_ns = exposure.ns / 2;
        const auto error_ns = static_cast<double>((middle.at - kStamp).ns - half_ns);
        sum += error_ns;
        squares += error_ns * error_ns;
        claimed_ns = static_cast<double>(middle.sigma.ns);
      }
      EXPECT_NEAR(sum / kCameras, 0, 200'000) << start << exposure_known;
      // 0.1 ms of it is the stamp's own, which these have not.
      EXPECT_NEAR(std::sqrt(squares / kCameras), std::sqrt(std::max(claimed_ns * claimed_ns - 1e10, 0.0)), 150'000)
          << start << exposure_known;
    }
  }
}

TEST(SequenceLine, CountsHoles) {
  SequenceLine line;
  const auto first = line.push(7);
  EXPECT_EQ(first.lost, 0U);
  EXPECT_EQ(line.push(8).lost, 0U);
  const auto after = line.push(11);
  EXPECT_EQ(after.lost, 2U);
  EXPECT_EQ(after.sequence, first.sequence + 4);
}

TEST(SequenceLine, GoesOnPast32Bits) {
  SequenceLine line;
  const auto first = line.push(0xffff'fffe);
  EXPECT_EQ(line.push(0xffff'ffff).lost, 0U);
  EXPECT_EQ(line.push(1).lost, 1U);
  EXPECT_EQ(line.push(2).sequence, first.sequence + 4);
}

TEST(SequenceLine, AHoleAfterAFirstZeroIsNone) {
  SequenceLine line;
  const auto first = line.push(0);
  const auto second = line.push(500);
  EXPECT_EQ(second.lost, 0U);
  EXPECT_EQ(second.sequence, first.sequence + 1);
  EXPECT_EQ(line.push(502).lost, 1U);
}

TEST(SequenceLine, BeginsAnewWhenTheStreamDoes) {
  SequenceLine line;
  const auto last = line.push(100);
  line.restart();
  EXPECT_EQ(line.push(3).lost, 0U);
  const auto back = line.push(1);  // without a word
  EXPECT_EQ(back.lost, 0U);
  EXPECT_EQ(back.sequence, last.sequence + 2);
  EXPECT_EQ(line.push(1).sequence, last.sequence + 3);  // a driver that does not count
  EXPECT_EQ(line.push(1).lost, 0U);
}

}  // namespace
}  // namespace birdseye::drivers
