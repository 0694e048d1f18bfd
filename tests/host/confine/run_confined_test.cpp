#include "host/confine/run_confined.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "host/confine/confinement.hpp"
#include "host/confine/isolated.hpp"

namespace birdseye::host {
namespace {

using ::testing::HasSubstr;

std::string doubled(std::string_view input) {
  return std::string(input).append(input);
}
std::string aborted(std::string_view) {
  std::abort();
}
std::string thrown(std::string_view) {
  throw std::bad_alloc();
}
std::string busy(std::string_view) {
  while (::getppid() != 0) {
  }
  return {};
}
std::string greedy(std::string_view) {
  std::string all(std::size_t{3} << 30U, 'x');
  return {all.back()};
}
/// What the kernel says to work that opens a file, sends a signal to what stands by, and starts another program.
std::string tried(std::string_view path) {
  std::string said;
  for (const auto attempt :
       {+[](const char* at) { return ::open(at, O_RDONLY); }, +[](const char*) { return ::kill(::getppid(), SIGKILL); },
        +[](const char* at) { return ::execl(at, at, nullptr); }}) {
    errno = 0;
    said += attempt(std::string(path).c_str()) < 0 && errno != 0 ? 'n' : 'y';
  }
  return said;
}

bool confines_here() {
  bool holds = false;
  const auto ran = run_isolated(
      [](const Send& send) {
        const bool calls = confine_to_bytes(0).system_calls;
        send(&calls, sizeof calls);
      },
      [&holds](const Receive& receive) { (void)receive(&holds, sizeof holds); }, Duration::from_ms(60'000));
  return ran && holds;
}

TEST(RunConfined, GivesWhatTheWorkMakes) {
  const std::string large(5U << 20U, 'a');
  for (const std::string& input : {std::string("ab"), std::string(), large}) {
    const auto made = run_confined(doubled, input, 1U << 24U);
    ASSERT_TRUE(made) << made.error().what;
    EXPECT_EQ(*made, input + input);
  }
}

TEST(RunConfined, WorkThatEndsItsProcessEndsNothingElse) {
  const auto ended = run_confined(aborted, "ab", 100);
  ASSERT_FALSE(ended);
  EXPECT_THAT(ended.error().what, HasSubstr("ended by signal 6"));
  const auto gave_up = run_confined(thrown, "ab", 100);
  ASSERT_FALSE(gave_up);
  EXPECT_EQ(gave_up.error().what, "gave up");
  EXPECT_EQ(run_confined(doubled, "ab", 100).value(), "abab");
}

TEST(RunConfined, TakesNoMoreThanWasAskedFor) {
  const auto more = run_confined(doubled, "abc", 5);
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().code, Errc::bad_value);
  EXPECT_EQ(run_confined(doubled, "abc", 6).value(), "abcabc");
}

TEST(RunConfined, HasTheMemoryAndTheTimeThatItsInputJustifies) {
  EXPECT_FALSE(run_confined(greedy, "ab", 100));
  const auto late = run_confined(busy, "ab", 100);
  ASSERT_FALSE(late);
  EXPECT_THAT(late.error().what, HasSubstr("ended by signal 24"));
}

TEST(RunConfined, ReachesNoFileAndNoOtherProcess) {
  if (!confines_here()) GTEST_SKIP() << "this kernel has no seccomp filters";
  EXPECT_EQ(run_confined(tried, "/etc/passwd", 100).value(), "nnn");
  EXPECT_EQ(run_confined(tried, "/bin/true", 100).value(), "nnn");
}

TEST(RunConfined, AnswersManyThreadsAlsoAfterTheFirstHasEnded) {
  std::thread([] { stand_by_to_confine(); }).join();
  std::atomic<int> right = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i)
    threads.emplace_back([i, &right] {
      const std::string input(1000, static_cast<char>('a' + i));
      for (int k = 0; k < 5; ++k) right += run_confined(doubled, input, 2000).value() == input + input ? 1 : 0;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(right, 40);
}

}  // namespace
}  // namespace birdseye::host
