#include "host/confine/run_confined.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <string>
#include <thread>
#include <vector>

#include "host/confine/isolated.hpp"
#include "tests/support/refused_calls.hpp"

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

std::string parent(std::string_view) {
  return std::to_string(::getppid());
}
/// Whether it has no standard input but nothing: /dev/null.
std::string has_nothing_to_read(std::string_view) {
  struct stat input {};
  return ::fstat(STDIN_FILENO, &input) == 0 && input.st_rdev == makedev(1, 3) ? "y" : "n";
}
std::string copied(std::string_view) {
  return ::fork() < 0 && errno != 0 ? "n" : "y";
}
std::string threaded(std::string_view) {
  bool ran = false;
  std::thread([&ran] { ran = true; }).join();
  return ran ? "y" : "n";
}

/// Whether the kernel has filters at all, not whether ours holds.
bool kernel_has_filters() {
  return ::prctl(PR_GET_SECCOMP) >= 0;
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
  EXPECT_EQ(gave_up.error().what, "its decoder gave up");
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
  EXPECT_THAT(late.error().what, HasSubstr("its decoder took longer than a file of its size justifies"));
  EXPECT_THAT(late.error().what, HasSubstr("ended by signal 24"));
}

TEST(RunConfined, ReachesNoFileAndNoOtherProcess) {
  if (!kernel_has_filters()) GTEST_SKIP() << "this kernel has no seccomp filters";
  EXPECT_EQ(run_confined(tried, "/etc/passwd", 100).value(), "nnn");
  EXPECT_EQ(run_confined(tried, "/bin/true", 100).value(), "nnn");
}

TEST(RunConfined, HasThreadsAndNoCopiesAndNothingToRead) {
  EXPECT_EQ(run_confined(threaded, "", 100).value(), "y");
  EXPECT_EQ(run_confined(has_nothing_to_read, "", 100).value(), "y");
  if (!kernel_has_filters()) GTEST_SKIP() << "this kernel has no seccomp filters";
  EXPECT_EQ(run_confined(copied, "", 100).value(), "n");
}

TEST(RunConfined, DoesNothingWhereTheSystemSetsNoFilter) {
  if (!kernel_has_filters()) GTEST_SKIP() << "this kernel has no seccomp filters";
  std::string came(500, ' ');
  const auto ran = run_isolated(
      [&](const Send& send) {
        if (!testing::refuse_calls({{SYS_seccomp}, {SYS_prctl, 0, PR_SET_SECCOMP}}, EINVAL)) return;
        const auto made = run_confined(doubled, "ab", 100);
        std::string said = made ? *made : made.error().what;
        said.resize(came.size(), ' ');
        send(said.data(), said.size());
      },
      [&](const Receive& receive) { (void)receive(came.data(), came.size()); }, Duration::from_ms(60'000));
  ASSERT_TRUE(ran) << ran.error().what;
  EXPECT_THAT(came, HasSubstr("its decoder cannot be confined: there is no filter of its system calls, seccomp"));
}

TEST(RunConfined, WhatStandsByIsMadeAnewWhereSomethingEndsIt) {
  const std::string before = run_confined(parent, "", 100).value();
  ASSERT_EQ(::kill(std::stoi(before), SIGINT), 0);
  EXPECT_EQ(run_confined(parent, "", 100).value(), before) << "whoever interrupts the program does not mean it";
  ASSERT_EQ(::kill(std::stoi(before), SIGKILL), 0);
  EXPECT_NE(run_confined(parent, "", 100).value(), before);
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
