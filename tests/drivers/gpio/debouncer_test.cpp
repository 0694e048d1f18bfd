#include "drivers/gpio/debouncer.hpp"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "drivers/gpio/kernel_stamps.hpp"

namespace birdseye::drivers {
namespace {

constexpr Duration kHold = Duration::from_ms(20);
DeviceTime at_us(std::int64_t us) {
  return {us * 1000};
}

struct Edge {
  bool active;
  std::int64_t us;
};

/// As a driver uses it: asks before every edge and after the last.
std::vector<Debouncer::Change> changes_of(Debouncer& debouncer, const std::vector<Edge>& edges) {
  std::vector<Debouncer::Change> changes;
  const auto ask = [&](DeviceTime time) {
    if (const auto change = debouncer.settle(time)) changes.push_back(*change);
  };
  for (const Edge& edge : edges) {
    ask(at_us(edge.us));
    debouncer.push(edge.active, at_us(edge.us));
  }
  if (debouncer.due()) ask(*debouncer.due());
  return changes;
}

TEST(Debouncer, APressIsOneHoweverItBounces) {
  Debouncer debouncer(kHold, false);
  const auto changes = changes_of(debouncer, {{true, 1000},
                                              {false, 1400},
                                              {true, 2100},
                                              {false, 2200},
                                              {true, 9000},
                                              {false, 500'000},
                                              {true, 500'300},
                                              {false, 503'000}});
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_TRUE(changes[0].active);
  EXPECT_EQ(changes[0].at, at_us(1000));
  EXPECT_FALSE(changes[1].active);
  EXPECT_EQ(changes[1].at, at_us(500'000));
  EXPECT_EQ(debouncer.bounces(), 6U);
}

TEST(Debouncer, ASpikeIsNoPress) {
  Debouncer debouncer(kHold, false);
  EXPECT_TRUE(changes_of(debouncer, {{true, 1000}, {false, 3000}, {true, 300'000}, {false, 319'000}}).empty());
  EXPECT_EQ(debouncer.bounces(), 4U);
}

TEST(Debouncer, ADropOutWhileHeldIsNoRelease) {
  Debouncer debouncer(kHold, false);
  EXPECT_EQ(changes_of(debouncer, {{true, 0}, {false, 200'000}, {true, 205'000}}).size(), 1U);
}

TEST(Debouncer, SaysWhenItIsToBeAskedAndNotBefore) {
  Debouncer debouncer(kHold, false);
  EXPECT_FALSE(debouncer.due());
  debouncer.push(true, at_us(1000));
  debouncer.push(true, at_us(4000));
  ASSERT_TRUE(debouncer.due());
  EXPECT_EQ(*debouncer.due(), at_us(24'000));
  EXPECT_FALSE(debouncer.settle(at_us(23'999)));
  const auto change = debouncer.settle(at_us(24'000));
  ASSERT_TRUE(change);
  EXPECT_EQ(change->at, at_us(1000));
  EXPECT_FALSE(debouncer.due());
  EXPECT_FALSE(debouncer.settle(at_us(99'000)));
}

TEST(Debouncer, APedalThatIsDownFromTheStartIsOnlyReleased) {
  Debouncer debouncer(kHold, true);
  EXPECT_TRUE(changes_of(debouncer, {{false, 5000}, {true, 6000}}).empty());
  const auto changes = changes_of(debouncer, {{false, 100'000}});
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_FALSE(changes[0].active);
}

TEST(Debouncer, AThousandPressesAreAThousand) {
  std::mt19937 random(11);
  const auto any = [&random](int least, int most) { return std::uniform_int_distribution<int>(least, most)(random); };
  Debouncer debouncer(kHold, false);
  std::vector<Edge> edges;
  std::vector<std::int64_t> begun_us;
  std::int64_t us = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool active = i % 2 == 0;
    us += any(25'000, 300'000);
    begun_us.push_back(us);
    edges.push_back({active, us});
    for (int bounces = any(0, 6); bounces > 0; --bounces) {
      edges.push_back({!active, us += any(10, 2000)});
      edges.push_back({active, us += any(10, 2000)});
    }
  }
  const auto changes = changes_of(debouncer, edges);
  ASSERT_EQ(changes.size(), 2000U);
  for (std::size_t i = 0; i < changes.size(); ++i) {
    EXPECT_EQ(changes[i].active, i % 2 == 0);
    EXPECT_EQ(changes[i].at, at_us(begun_us[i]));
  }
  EXPECT_EQ(debouncer.bounces(), edges.size() - 2000);
}

TEST(KernelStamps, AreMonotonicSince5Point7) {
  EXPECT_TRUE(stamps_edges_monotonic("5.7.0"));
  EXPECT_TRUE(stamps_edges_monotonic("6.1.0-56-amd64"));
  EXPECT_TRUE(stamps_edges_monotonic("5.10.0"));
  EXPECT_FALSE(stamps_edges_monotonic("5.6.19"));
  EXPECT_FALSE(stamps_edges_monotonic("4.19.0-27-arm64"));
  EXPECT_FALSE(stamps_edges_monotonic(""));
  EXPECT_FALSE(stamps_edges_monotonic("rolling"));
}

}  // namespace
}  // namespace birdseye::drivers
