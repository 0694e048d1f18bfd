#include "calibration/time/rate_limit.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace birdseye {
namespace {

constexpr Duration kApart = Duration::from_ms(10);
constexpr std::int64_t kAtOnce = 5;

DeviceTime at_ms(std::int64_t ms) {
  return DeviceTime{} + Duration::from_ms(ms);
}

TEST(RateLimit, LetsSoManyPassAtOnceAndThenOneEverySoOften) {
  RateLimit limit(kApart, kAtOnce);
  for (int i = 0; i <= kAtOnce; ++i) {
    EXPECT_LE(limit.free_at(), at_ms(1000)) << i;
    limit.passed(at_ms(1000));
  }
  EXPECT_EQ(limit.free_at(), at_ms(1010));
  limit.passed(at_ms(1010));
  EXPECT_EQ(limit.free_at(), at_ms(1020));
}

TEST(RateLimit, ManyTogetherAreOwedForOneByOne) {
  RateLimit limit(kApart, kAtOnce);
  limit.passed(at_ms(1000), 70);
  EXPECT_EQ(limit.free_at(), at_ms(1000 + 700 - 50));
}

TEST(RateLimit, InNoSpanMoreThanItsRateAndWhatIsLetPassAtOnce) {
  std::mt19937 random(5);
  RateLimit limit(kApart, kAtOnce);
  std::vector<std::int64_t> passed_ms;
  std::int64_t now_ms = 0;
  for (int i = 0; i < 5000; ++i) {
    now_ms += random() % 100 == 0 ? 300 : random() % 6;
    if (limit.free_at() > at_ms(now_ms)) continue;
    limit.passed(at_ms(now_ms));
    passed_ms.push_back(now_ms);
  }
  ASSERT_GT(passed_ms.size(), 1000U);
  for (std::size_t first = 0; first < passed_ms.size(); ++first) {
    const std::size_t last = std::min(passed_ms.size() - 1, first + 50);
    const auto count = static_cast<std::int64_t>(last - first);
    EXPECT_GE(passed_ms[last] - passed_ms[first], (count - kAtOnce) * 10);
  }
}

}  // namespace
}  // namespace birdseye
