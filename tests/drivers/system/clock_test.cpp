#include "drivers/system/clock.hpp"

#include <gtest/gtest.h>

#include <type_traits>

namespace birdseye {
namespace {

TEST(Clock, NeverGoesBackAndIsOneForBothKindsOfTime) {
  const DeviceTime before = device_now();
  const HostTime between = host_now();
  const DeviceTime after = device_now();
  EXPECT_LE(before.ns, between.ns);
  EXPECT_LE(between.ns, after.ns);
}

TEST(Clock, TheTimeOfDayIsTextThatSortsAsTimeDoes) {
  const std::string before = utc_now();
  const std::string after = utc_now();
  ASSERT_EQ(before.size(), std::string("2026-11-22T22:51:36Z").size());
  EXPECT_EQ(before[10], 'T');
  EXPECT_EQ(before.back(), 'Z');
  EXPECT_LE(before, after);
  EXPECT_GT(before, "2024");
}

TEST(Deadline, IsMadeOfTimesAloneAndGivesNoneBack) {
  static_assert(std::is_convertible_v<DeviceTime, Deadline> && std::is_convertible_v<HostTime, Deadline>);
  static_assert(!std::is_convertible_v<std::int64_t, Deadline> && !std::is_convertible_v<Duration, Deadline>);
  static_assert(!std::is_convertible_v<Deadline, DeviceTime> && !std::is_convertible_v<Deadline, HostTime>);
  EXPECT_EQ(Deadline(DeviceTime{5}), Deadline(HostTime{5}));
  EXPECT_LT(Deadline(DeviceTime{5}), Deadline(HostTime{6}));
}

TEST(Deadline, HasPassedOnceNothingIsLeft) {
  const Deadline now = device_now();
  EXPECT_TRUE(now.passed());
  EXPECT_EQ(now.left().ns, 0);
  EXPECT_TRUE(Deadline(DeviceTime{INT64_MIN}).passed());
  const Deadline far = Deadline::after(Duration::from_ms(3'600'000));
  EXPECT_FALSE(far.passed());
  const Duration left = far.left();
  EXPECT_GT(left.ns, 0);
  EXPECT_LE(left, Duration::from_ms(3'600'000));
  EXPECT_LE(far.left(), left);
}

}  // namespace
}  // namespace birdseye
