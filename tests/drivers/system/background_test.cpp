#include "drivers/system/background.hpp"

#include <gtest/gtest.h>

#include <memory>

#include "drivers/system/blocking_queue.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye {
namespace {

using Gate = BlockingQueue<int, 1>;

constexpr Duration kShortWork = Duration::from_ms(5), kLongWork = Duration::from_ms(60'000);

std::shared_ptr<Gate> gate() {
  return std::make_shared<Gate>(Gate::Lanes{{{4}}});
}

/// Cannot be stopped: ends when the gate is opened.
Background<int>::Work behind(const std::shared_ptr<Gate>& opens, int gives) {
  return [opens, gives](const std::stop_token&, const auto& say) {
    say("behind the gate");
    opens->pop(Deadline::after(kLongWork));
    return gives;
  };
}

std::optional<int> outcome(Background<int>& background) {
  const Deadline deadline = Deadline::after(kLongWork);
  while (background.running() && !deadline.passed()) sleep_for(kShortWork);
  return background.take();
}

TEST(Background, GivesWhatComesOfTheWorkOnce) {
  Background<int> background;
  EXPECT_FALSE(background.running());
  EXPECT_FALSE(background.take());
  background.start([](const std::stop_token&, const auto& say) {
    say("half");
    return 7;
  });
  EXPECT_EQ(outcome(background), 7);
  EXPECT_EQ(background.line(), "half");
  EXPECT_FALSE(background.take());
}

TEST(Background, CancelledWorkIsToldAndStillGivesSomething) {
  Background<int> background;
  background.start([](const std::stop_token& stop, const auto&) {
    while (!stop.stop_requested()) sleep_for(kLongWork, stop);
    return 3;
  });
  background.cancel();
  EXPECT_EQ(outcome(background), 3);
  background.start([](const std::stop_token& stop, const auto&) { return stop.stop_requested() ? 1 : 2; });
  EXPECT_EQ(outcome(background), 2);
}

TEST(Background, WhatIsStartedAnewWaitsForTheWorkBeforeAndNobodyElseDoes) {
  Background<int> background;
  const auto opens = gate();
  background.start(behind(opens, 1));
  const Deadline deadline = Deadline::after(kLongWork);
  while (background.line().empty() && !deadline.passed()) sleep_for(kShortWork);
  // Neither of these could return if it waited: the gate is opened below.
  background.start([](const std::stop_token&, const auto&) { return 2; });
  background.start([](const std::stop_token& stop, const auto&) { return stop.stop_requested() ? 4 : 3; });
  EXPECT_TRUE(background.running());
  EXPECT_EQ(background.take(), std::nullopt);
  opens->push(0, 0);
  EXPECT_EQ(outcome(background), 3) << "the newest, and of the others nothing";
}

TEST(Background, LetsGoOfWorkThatHangsWhenItsOwnerGoes) {
  const auto opens = gate(), gone = gate();
  {
    Background<int> background(kShortWork);
    background.start([opens, gone](const std::stop_token&, const auto&) {
      opens->pop(Deadline::after(kLongWork));
      gone->push(0, 1);
      return 0;
    });
  }
  opens->push(0, 0);
  EXPECT_TRUE(gone->pop(Deadline::after(kLongWork))) << "it has ended by itself, and touched nothing of its owner's";
}

/// Also where the thread has not begun it yet: what was to be written is written.
TEST(Background, WaitsForWorkThatStopsWhenItsOwnerGoes) {
  const auto ended = std::make_shared<bool>(false);
  {
    Background<int> background(kLongWork);
    background.start([ended](const std::stop_token& stop, const auto&) {
      while (!stop.stop_requested()) sleep_for(kLongWork, stop);
      *ended = true;
      return 0;
    });
  }
  EXPECT_TRUE(*ended);
}

}  // namespace
}  // namespace birdseye
