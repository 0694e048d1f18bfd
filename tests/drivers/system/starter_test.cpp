#include "drivers/system/starter.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>

#include "drivers/system/child_process.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye {
namespace {

constexpr Duration kAWhile = Duration::from_ms(50), kPatience = Duration::from_ms(60'000);

/// Programs that are started take on which signals are blocked, and a service's tests block some.
class EndWithStandardInput : public ::testing::Test {
 protected:
  EndWithStandardInput() {
    sigset_t terminate;
    ::sigemptyset(&terminate);
    ::sigaddset(&terminate, SIGTERM);
    ::pthread_sigmask(SIG_UNBLOCK, &terminate, &before_);
  }
  ~EndWithStandardInput() override { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

/// A process that ends with its standard input: with code 7 where it follows the signal.
pid_t start_watching(const std::array<int, 2>& pipe, bool follows) {
  const pid_t child = ::fork();
  if (child != 0) return child;
  ::dup2(pipe[0], STDIN_FILENO);
  ::close(pipe[1]);
  ::signal(SIGTERM, follows ? [](int) { ::_exit(7); } : SIG_IGN);
  const OwnedThread watch = end_with_standard_input();
  for (;;) sleep_for(kAWhile);
}

int status_of_one_whose_input_is_closed(bool follows) {
  std::array<int, 2> ends{-1, -1};
  EXPECT_EQ(::pipe2(ends.data(), O_CLOEXEC), 0);
  const pid_t child = start_watching(ends, follows);
  ::close(ends[0]);
  // What comes is no end.
  EXPECT_EQ(::write(ends[1], "x", 1), 1);
  sleep_for(kAWhile);
  int status = 0;
  EXPECT_EQ(::waitpid(child, &status, WNOHANG), 0) << "it has ended too soon";
  ::close(ends[1]);
  EXPECT_EQ(::waitpid(child, &status, 0), child);
  return status;
}

TEST_F(EndWithStandardInput, AsksToEndAndThenEnds) {
  const int asked = status_of_one_whose_input_is_closed(true);
  EXPECT_TRUE(WIFEXITED(asked) && WEXITSTATUS(asked) == 7) << asked;
  const int made_to = status_of_one_whose_input_is_closed(false);
  EXPECT_TRUE(WIFSIGNALED(made_to) && WTERMSIG(made_to) == SIGKILL) << made_to;
}

TEST_F(EndWithStandardInput, OurPipeStaysOpenWhileWeLive) {
  auto child = ChildProcess::start({"cat"}, "/dev/null", ChildProcess::Pipe::none, ChildProcess::Signals::with_us,
                                   ChildProcess::Life::ours);
  ASSERT_TRUE(child);
  EXPECT_FALSE(child->wait(Deadline::after(kAWhile))) << "its input has ended";
  ChildProcess moved = std::move(*child);
  EXPECT_FALSE(moved.wait(Deadline::after(kAWhile)));
  moved.stop();
  EXPECT_EQ(moved.wait(Deadline::after(kPatience)), 128 + SIGTERM);
}

}  // namespace
}  // namespace birdseye
