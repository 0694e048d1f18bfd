#include "calibration/base/bounded_queue.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace birdseye {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

template <std::size_t kLanes>
std::vector<int> drain(BoundedQueue<int, kLanes>& queue) {
  std::vector<int> values;
  while (const auto value = queue.pop()) values.push_back(*value);
  return values;
}

TEST(BoundedQueue, GivesInTheOrderInWhichItWasGivenWhateverTheLane) {
  BoundedQueue<int, 3> queue({{{4}, {4}, {4}}});
  EXPECT_TRUE(queue.empty());
  for (const auto& [lane, value] : {std::pair{1, 10}, {0, 11}, {2, 12}, {1, 13}, {0, 14}})
    EXPECT_TRUE(queue.push(static_cast<std::size_t>(lane), value));
  EXPECT_FALSE(queue.empty());
  EXPECT_THAT(drain(queue), ElementsAre(10, 11, 12, 13, 14));
  EXPECT_TRUE(queue.empty());
}

TEST(BoundedQueue, DropsTheOldestOfItsLaneOrRefusesAndCountsIt) {
  BoundedQueue<int, 2> queue({{{2, WhenFull::drop_oldest}, {2, WhenFull::refuse}}});
  for (const int value : {1, 2}) {
    EXPECT_TRUE(queue.push(0, value));
    EXPECT_TRUE(queue.push(1, -value));
  }
  EXPECT_FALSE(queue.push(0, 3));
  EXPECT_FALSE(queue.push(1, -3));
  EXPECT_EQ(queue.dropped(0), 1U);
  EXPECT_EQ(queue.dropped(1), 1U);
  EXPECT_THAT(drain(queue), ElementsAre(-1, 2, -2, 3));
}

TEST(BoundedQueue, WithoutRoomLosesAllAndCountsAll) {
  BoundedQueue<int, 2> queue({{{0, WhenFull::drop_oldest}, {0, WhenFull::refuse}}});
  for (const std::size_t lane : {0U, 1U}) EXPECT_FALSE(queue.push(lane, 7));
  EXPECT_THAT(drain(queue), IsEmpty());
  EXPECT_EQ(queue.dropped(0) + queue.dropped(1), 2U);
}

TEST(BoundedQueue, ALargeValuePushesOutAsManyAsItTakesAndIsRefusedWhereItFitsNowhere) {
  BoundedQueue<int, 2> queue({{{10, WhenFull::drop_oldest, 100}, {10, WhenFull::refuse, 100}}});
  for (const int value : {1, 2, 3}) {
    EXPECT_TRUE(queue.push(0, value, 30));
    EXPECT_TRUE(queue.push(1, -value, 30));
  }
  EXPECT_FALSE(queue.push(0, 4, 70));
  EXPECT_FALSE(queue.push(1, -4, 70));
  EXPECT_TRUE(queue.push(1, -5, 10));
  EXPECT_EQ(queue.dropped(0), 2U);
  EXPECT_THAT(drain(queue), ElementsAre(-1, -2, 3, -3, 4, -5));
  EXPECT_FALSE(queue.push(0, 6, 101));
  EXPECT_FALSE(queue.push(1, -6, SIZE_MAX));
  EXPECT_TRUE(queue.empty());
  EXPECT_TRUE(queue.push(0, 7, 100)) << "what was taken or dropped holds nothing";
}

TEST(BoundedQueue, TellsHowFullALaneIsBesideItsBounds) {
  BoundedQueue<int, 2> queue({{{3, WhenFull::drop_oldest, 100}, {10}}});
  queue.push(0, 1, 30);
  queue.push(0, 2, 40);
  const QueueFill fill = queue.fill(0, "numbers");
  EXPECT_EQ(fill.queue, "numbers");
  EXPECT_THAT((std::vector{fill.values, fill.most_values, fill.bytes, fill.most_bytes}), ElementsAre(2, 3, 70, 100));
  EXPECT_EQ(queue.fill(1, "others").values, 0U);
}

TEST(BoundedQueue, WhatIsPushedIsTakenWaitsOrIsCounted) {
  std::mt19937 random(7);
  BoundedQueue<int, 2> queue({{{5, WhenFull::drop_oldest}, {3, WhenFull::refuse}}});
  std::uint64_t pushed = 0, taken = 0;
  int newest = -1;
  for (int step = 0; step < 20'000; ++step) {
    if (random() % 5 < 3) {
      queue.push(random() % 2, step);
      ++pushed;
    } else if (const auto value = queue.pop()) {
      EXPECT_GT(*value, newest);
      newest = *value;
      ++taken;
    }
  }
  taken += drain(queue).size();
  EXPECT_GT(queue.dropped(0), 0U);
  EXPECT_GT(queue.dropped(1), 0U);
  EXPECT_EQ(pushed, taken + queue.dropped(0) + queue.dropped(1));
}

}  // namespace
}  // namespace birdseye
