#include "hw-sim/time/virtual_time.hpp"

#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "drivers/system/background.hpp"
#include "drivers/system/blocking_queue.hpp"
#include "drivers/system/clock.hpp"
#include "drivers/system/thread.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::hw_sim {
namespace {

constexpr Duration ms(std::int64_t count) {
  return Duration::from_ms(count);
}

using Queue = BlockingQueue<int, 1>;
constexpr Queue::Lanes kHundred{{{100, WhenFull::refuse}}};

/// Three threads that each say their name every few ms, as fast as the order lets them.
std::string said_by_three(std::uint64_t seed) {
  std::string said;
  const auto ran = run_in_virtual_time({.seed = seed}, [&] {
    std::vector<OwnedThread> threads;
    for (const char name : {'a', 'b', 'c'}) {
      threads.emplace_back([&said, name](const std::stop_token&) {
        for (int i = 0; i < 20; ++i) {
          said += name;
          sleep_for(ms(1));
        }
      });
    }
    for (OwnedThread& thread : threads) thread.join();
  });
  EXPECT_TRUE(ran);
  return said;
}

TEST(VirtualTime, AnHourOfWaitingIsOneEventAfterTheOther) {
  std::vector<std::int64_t> woke_ns;
  const auto ran = run_in_virtual_time({}, [&] {
    const DeviceTime began = device_now();
    OwnedThread late([&](const std::stop_token&) {
      sleep_for(ms(3'600'000));
      woke_ns.push_back((device_now() - began).ns);
    });
    OwnedThread early([&](const std::stop_token&) {
      sleep_for(Duration{7});
      woke_ns.push_back((device_now() - began).ns);
    });
    early.join();
    late.join();
  });
  ASSERT_TRUE(ran) << ran.error().what;
  EXPECT_EQ(woke_ns, (std::vector<std::int64_t>{7, 3'600'000'000'000}));
  EXPECT_EQ(ran->elapsed_ns, 3'600'000'000'000);
  EXPECT_EQ(ran->threads, 3U);
  EXPECT_LT(ran->switches, 12U);
}

TEST(VirtualTime, TheSeedDecidesWhoGoesOnAndNothingElse) {
  const std::string first = said_by_three(1);
  EXPECT_EQ(first.size(), 60U);
  EXPECT_EQ(said_by_three(1), first);
  std::set<std::string> orders;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) orders.insert(said_by_three(seed));
  EXPECT_EQ(orders.size(), 8U);
}

TEST(VirtualTime, AQueueBetweenThreadsKeepsItsOrderAndItsDeadlines) {
  Queue queue(kHundred);
  std::vector<int> taken;
  const auto ran = run_in_virtual_time({.seed = 3}, [&] {
    const OwnedThread feeder([&](const std::stop_token&) {
      for (int i = 0; i < 50; ++i) {
        sleep_for(Duration{i * 1000});
        queue.push(0, i);
      }
      queue.close();
    });
    const DeviceTime began = device_now();
    EXPECT_FALSE(Queue(kHundred).pop(began + ms(1)));
    EXPECT_EQ((device_now() - began).ns, ms(1).ns);
    while (!queue.finished()) {
      if (const auto next = queue.pop(std::stop_token())) taken.push_back(*next);
    }
  });
  ASSERT_TRUE(ran) << ran.error().what;
  ASSERT_EQ(taken.size(), 50U);
  for (int i = 0; i < 50; ++i) EXPECT_EQ(taken[static_cast<std::size_t>(i)], i);
}

TEST(VirtualTime, AStopEndsASleepAtItsOwnTime) {
  const auto ran = run_in_virtual_time({}, [] {
    const DeviceTime began = device_now();
    OwnedThread sleeper([](const std::stop_token& stop) { EXPECT_FALSE(sleep_for(ms(60'000), stop)); });
    sleep_for(ms(5));
    sleeper.request_stop();
    sleeper.join();
    EXPECT_EQ((device_now() - began).ns, ms(5).ns);
  });
  EXPECT_TRUE(ran);
}

TEST(VirtualTime, WorkInTheBackgroundAndWorkThatHangsEndByTheirDeadlines) {
  const auto ran = run_in_virtual_time({}, [] {
    const DeviceTime began = device_now();
    const auto given = given_by<int>(began + ms(100), [] {
      sleep_for(ms(3'600'000));
      return 1;
    });
    EXPECT_FALSE(given);
    EXPECT_EQ((device_now() - began).ns, ms(100).ns);
    Background<int> background;
    background.start([](const std::stop_token&, const Background<int>::Say& say) {
      say("begun");
      sleep_for(ms(20));
      return 7;
    });
    EXPECT_TRUE(background.running());
    sleep_for(ms(10));
    EXPECT_EQ(background.line(), "begun");
    EXPECT_FALSE(background.take());
    sleep_for(ms(11));
    EXPECT_EQ(background.take(), 7);
  });
  ASSERT_TRUE(ran) << ran.error().what;
  EXPECT_GE(ran->elapsed_ns, 3'600'000'000'000) << "what was let go goes on";
}

TEST(VirtualTime, ThreadsThatWaitForEachOtherAreSaid) {
  const auto stuck = std::make_shared<Queue>(kHundred);
  const auto ran = run_in_virtual_time({}, [stuck] { (void)stuck->pop(std::stop_token()); });
  ASSERT_FALSE(ran);
  EXPECT_EQ(ran.error().code, Errc::timeout);
  EXPECT_NE(ran.error().what.find("1 threads wait for each other"), std::string::npos) << ran.error().what;
  EXPECT_EQ(TimeKeeper::present(), nullptr);
}

TEST(VirtualTime, TheMachinesTimeIsBackAfterwards) {
  const DeviceTime before = device_now();
  ASSERT_TRUE(run_in_virtual_time({.begins_monotonic_ns = 5}, [] { EXPECT_EQ(device_now().ns, 5); }));
  EXPECT_GE(device_now(), before);
}

}  // namespace
}  // namespace birdseye::hw_sim
