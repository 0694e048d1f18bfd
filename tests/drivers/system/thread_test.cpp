#include "drivers/system/thread.hpp"

#include <gtest/gtest.h>
#include <sched.h>

#include <array>
#include <atomic>
#include <memory>
#include <vector>

#include "drivers/system/blocking_queue.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye {
namespace {

using Queue = BlockingQueue<int, 1>;

constexpr Duration kShortThread = Duration::from_ms(5), kLongThread = Duration::from_ms(60'000);

TEST(OwnedThread, IsAskedToStopAndWaitedForWhenItsOwnerGoes) {
  std::atomic<bool> ended = false;
  {
    const OwnedThread thread([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) sleep_for(kLongThread, stop);
      ended = true;
    });
  }
  EXPECT_TRUE(ended);
  OwnedThread().join();  // nothing to wait for
}

TEST(OwnedThread, IsRealTimeWhereThatIsAllowedAndAsBeforeElse) {
  const OwnedThread thread([](const std::stop_token&) {
    const int before = ::sched_getscheduler(0);
    const bool allowed = schedule_this_thread_real_time();
    EXPECT_EQ(::sched_getscheduler(0), allowed ? SCHED_RR : before);
  });
}

TEST(Condition, HoldsOnceItIsToldAndNotByTheDeadlineElse) {
  std::mutex mutex;
  Condition changed;
  bool done = false;
  OwnedThread teller;
  {
    std::unique_lock lock(mutex);
    const Deadline soon = Deadline::after(kShortThread);
    EXPECT_FALSE(changed.wait(lock, soon, [&] { return done; }));
    EXPECT_TRUE(soon.passed());
    teller = OwnedThread([&](const std::stop_token&) {
      const std::lock_guard guard(mutex);
      done = true;
      changed.notify_all();
    });
    EXPECT_TRUE(changed.wait(lock, Deadline::after(kLongThread), [&] { return done; }));
    EXPECT_TRUE(changed.wait(lock, device_now(), [&] { return done; }));  // what holds holds, however late it is
  }
}

TEST(Condition, AStopEndsTheWait) {
  std::mutex mutex;
  Condition changed;
  std::stop_source stop;
  OwnedThread stopper([&](const std::stop_token&) { stop.request_stop(); });
  std::unique_lock lock(mutex);
  EXPECT_FALSE(changed.wait(lock, stop.get_token(), [] { return false; }));
  EXPECT_FALSE(changed.wait(lock, stop.get_token(), Deadline::after(kLongThread), [] { return false; }));
}

TEST(GivenBy, GivesWhatComesInTimeAndThrowsAwayWhatIsLate) {
  EXPECT_EQ(given_by<int>(Deadline::after(kLongThread), [] { return 42; }), 42);
  const auto owned =
      given_by<std::unique_ptr<int>>(Deadline::after(kLongThread), [] { return std::make_unique<int>(7); });
  ASSERT_TRUE(owned && *owned);
  EXPECT_EQ(**owned, 7);

  // The work owns the queue with the test: it may outlive either.
  const auto go = std::make_shared<Queue>(Queue::Lanes{{{1}}});
  const auto gone = std::make_shared<Queue>(Queue::Lanes{{{1}}});
  EXPECT_FALSE(given_by<int>(Deadline::after(kShortThread), [go, gone] {
    go->pop(Deadline::after(kLongThread));
    gone->push(0, 1);
    return 1;
  }));
  go->push(0, 0);
  EXPECT_TRUE(gone->pop(Deadline::after(kLongThread)));
}

TEST(BlockingQueue, ClosedGivesWhatWaitsAndThenNothingAtOnce) {
  Queue queue(Queue::Lanes{{{4}}});
  EXPECT_FALSE(queue.pop(Deadline::after(kShortThread)));
  queue.push(0, 1);
  queue.close();
  EXPECT_FALSE(queue.finished());
  EXPECT_EQ(queue.pop(Deadline::after(kLongThread)), 1);
  EXPECT_TRUE(queue.finished());
  const Deadline long_after = Deadline::after(kLongThread);
  EXPECT_FALSE(queue.pop(long_after));
  EXPECT_FALSE(queue.pop(std::stop_token()));
  EXPECT_FALSE(long_after.passed());
}

TEST(BlockingQueue, AStopEndsTheWaitAndAPushToo) {
  Queue queue(Queue::Lanes{{{4}}});
  std::stop_source stop;
  OwnedThread stopper([&](const std::stop_token&) { stop.request_stop(); });
  EXPECT_FALSE(queue.pop(Deadline::after(kLongThread), stop.get_token()));
  OwnedThread pusher([&](const std::stop_token&) { queue.push(0, 3); });
  EXPECT_EQ(queue.pop(Deadline::after(kLongThread)), 3);
}

TEST(BlockingQueue, OfManyWhoPushNothingIsLostUncountedAndEachKeepsItsOrder) {
  constexpr int kPushers = 4, kEach = 5000;
  using Pairs = BlockingQueue<std::pair<int, int>, 1>;
  Pairs queue(Pairs::Lanes{{{64, WhenFull::drop_oldest}}});
  std::vector<OwnedThread> pushers;
  for (int who = 0; who < kPushers; ++who) {
    pushers.emplace_back([&queue, who](const std::stop_token&) {
      for (int i = 0; i < kEach; ++i) queue.push(0, {who, i});
    });
  }
  OwnedThread closer([&](const std::stop_token&) {
    for (OwnedThread& pusher : pushers) pusher.join();
    queue.close();
  });
  std::array<int, kPushers> newest{-1, -1, -1, -1};
  std::uint64_t taken = 0;
  while (!queue.finished()) {
    const auto value = queue.pop(Deadline::after(kLongThread));
    if (!value) continue;
    int& last = newest[static_cast<std::size_t>(value->first)];
    EXPECT_GT(value->second, last);
    last = value->second;
    ++taken;
  }
  EXPECT_EQ(taken + queue.dropped(0), std::uint64_t{kPushers} * kEach);
}

}  // namespace
}  // namespace birdseye
