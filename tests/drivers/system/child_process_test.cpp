#include "drivers/system/child_process.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

namespace birdseye {
namespace {

constexpr Duration kShort = Duration::from_ms(5), kLong = Duration::from_ms(60'000);

Result<ChildProcess> shell(const std::string& script, ChildProcess::Pipe pipe = ChildProcess::Pipe::none) {
  return ChildProcess::start({"sh", "-c", script}, "/dev/null", pipe);
}

TEST(ChildProcess, GivesLinesUntilItEndsAndThenItsExitCode) {
  auto child = shell("echo one; echo two; exit 7", ChildProcess::Pipe::stdout_from_child);
  ASSERT_TRUE(child);
  EXPECT_EQ(*child->read_line(Deadline::after(kLong)), "one");
  EXPECT_EQ(*child->read_line(Deadline::after(kLong)), "two");
  EXPECT_EQ(child->read_line(Deadline::after(kLong)).error().code, Errc::disconnected);
  EXPECT_EQ(child->wait(Deadline::after(kLong)), 7);
}

TEST(ChildProcess, IsNotWaitedForBeyondTheDeadline) {
  auto child = shell("exec sleep 600", ChildProcess::Pipe::stdout_from_child);
  ASSERT_TRUE(child);
  const auto line = child->read_line(Deadline::after(kShort));
  ASSERT_TRUE(line);
  EXPECT_FALSE(*line);
  char byte = 0;
  EXPECT_EQ(child->read(&byte, 1, Deadline::after(kShort)).error().code, Errc::timeout);
  EXPECT_FALSE(child->wait(Deadline::after(kShort)));
  child->stop();
  EXPECT_EQ(child->wait(Deadline::after(kLong)), 128 + SIGTERM);
}

TEST(ChildProcess, TakesItsInputToTheEnd) {
  auto child = shell("test \"$(wc -c)\" -eq 300000", ChildProcess::Pipe::stdin_to_child);
  ASSERT_TRUE(child);
  const std::string input(300'000, 'x');
  ASSERT_TRUE(child->write(input.data(), input.size(), Deadline::after(kLong)));
  child->close_pipe();
  EXPECT_EQ(child->wait(Deadline::after(kLong)), 0);
}

TEST(ChildProcess, ItsMemoryIsBoundedAndOursIsNot) {
  rlimit before{}, after{};
  ASSERT_EQ(::getrlimit(RLIMIT_AS, &before), 0);
  auto child = shell("read go && test \"$(ulimit -v)\" -eq 65536", ChildProcess::Pipe::stdin_to_child);
  ASSERT_TRUE(child);
  child->bound_memory(std::uint64_t{64} << 20U);
  ASSERT_TRUE(child->write("go\n", 3, Deadline::after(kLong)));
  EXPECT_EQ(child->wait(Deadline::after(kLong)), 0);
  child->bound_memory(1);  // it has ended
  ASSERT_EQ(::getrlimit(RLIMIT_AS, &after), 0);
  EXPECT_EQ(after.rlim_cur, before.rlim_cur);
}

TEST(ChildProcess, OneThatIsNotThereIsAnError) {
  EXPECT_EQ(ChildProcess::start({"/no/such/program"}, "/dev/null").error().code, Errc::not_found);
}

}  // namespace
}  // namespace birdseye
