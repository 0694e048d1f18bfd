#include "drivers/system/wait.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>

#include "drivers/system/pipe.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye {
namespace {

constexpr Duration kShortWait = Duration::from_ms(5), kLongWait = Duration::from_ms(60'000);

struct OnePipe : Pipe {
  OnePipe() : Pipe(Pipe::open().value()) {}
  void fill() const { EXPECT_EQ(::write(in.get(), "x", 1), 1); }
};

TEST(Wait, SleepsUntilTheMomentAndNoLessThanTheSpan) {
  const DeviceTime end = device_now() + kShortWait;
  sleep_until(end);
  EXPECT_GE(device_now(), end);
  const DeviceTime began = device_now();
  sleep_for(kShortWait);
  EXPECT_GE(device_now(), began + kShortWait);
  sleep_until(DeviceTime{-1});
}

TEST(Wait, AStopEndsASleepAndTheSpanEndsItElse) {
  std::stop_source stop;
  EXPECT_TRUE(sleep_for(kShortWait, stop.get_token()));
  OwnedThread stopper([&](const std::stop_token&) { stop.request_stop(); });
  const Deadline long_after = Deadline::after(kLongWait);
  EXPECT_FALSE(sleep_for(kLongWait, stop.get_token()));
  EXPECT_FALSE(long_after.passed());
}

TEST(Wait, AnEmptyPipeIsNotReadableAndAFullOneIs) {
  const OnePipe pipe;
  const Deadline soon = Deadline::after(kShortWait);
  EXPECT_EQ(wait_ready(pipe.out.get(), POLLIN, soon), 0);
  EXPECT_TRUE(soon.passed());
  EXPECT_EQ(wait_ready(pipe.in.get(), POLLOUT, device_now()), POLLOUT);
  pipe.fill();
  EXPECT_EQ(wait_ready(pipe.out.get(), POLLIN, device_now()), POLLIN);  // what is there is seen however late it is
}

TEST(Wait, AWriterThatHasGoneIsTold) {
  OnePipe pipe;
  OwnedThread closer([&](const std::stop_token&) { pipe.in = UniqueFd(); });
  EXPECT_EQ(wait_ready(pipe.out.get(), POLLIN, Deadline::after(kLongWait)), POLLHUP);
}

TEST(Wait, OfSeveralTheReadyOnesAreToldAndNobodyIsNeverReady) {
  const OnePipe silent, speaking;
  std::array<pollfd, 3> entries{{{silent.out.get(), POLLIN, 0}, {-1, POLLIN, 0}, {speaking.out.get(), POLLIN, 0}}};
  EXPECT_FALSE(wait_ready(entries, Deadline::after(kShortWait)));
  OwnedThread speaker([&](const std::stop_token&) { speaking.fill(); });
  EXPECT_TRUE(wait_ready(entries, Deadline::after(kLongWait)));
  EXPECT_EQ(entries[0].revents, 0);
  EXPECT_EQ(entries[1].revents, 0);
  EXPECT_EQ(entries[2].revents, POLLIN);
}

}  // namespace
}  // namespace birdseye
