#include "drivers/system/process_copy.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <functional>
#include <optional>
#include <stdexcept>
#include <vector>

#include "drivers/system/thread.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye {
namespace {

using ::testing::HasSubstr;

constexpr Duration kShortCopy = Duration::from_ms(50), kLongCopy = Duration::from_ms(60'000);

bool is_gone(pid_t process) {
  return ::kill(process, 0) != 0 && errno == ESRCH;
}

/// What receiving one byte says of a copy that does this.
Error error_of(const std::function<void(const ProcessCopy::Send&)>& work, Duration within = kLongCopy) {
  auto copy = ProcessCopy::start(work);
  if (!copy) return copy.error();
  char byte = 0;
  const auto received = copy->receive(&byte, 1, Deadline::after(within));
  return received ? Error{Errc::bad_value, "a byte came"} : received.error();
}

TEST(ProcessCopy, SendsMoreThanAPipeHoldsAndKnowsWhatThisProcessKnew) {
  const std::vector<int> values(3'000'000, 42);
  auto copy =
      ProcessCopy::start([&](const ProcessCopy::Send& send) { send(values.data(), values.size() * sizeof values[0]); });
  ASSERT_TRUE(copy);
  std::vector<int> received(values.size());
  ASSERT_TRUE(copy->receive(received.data(), received.size() * sizeof received[0], Deadline::after(kLongCopy)));
  EXPECT_EQ(received, values);
  char more = 0;
  EXPECT_EQ(copy->receive(&more, 1, Deadline::after(kLongCopy)).error().code, Errc::disconnected);
}

TEST(ProcessCopy, OneThatHangsIsKilledAtItsDeadline) {
  auto copy = ProcessCopy::start([](const ProcessCopy::Send& send) {
    send("x", 1);
    ::signal(SIGTERM, SIG_IGN);
    for (;;) sleep_for(kLongCopy);
  });
  ASSERT_TRUE(copy);
  const pid_t process = copy->pid();
  std::array<char, 2> bytes{};
  const auto received = copy->receive(bytes.data(), bytes.size(), Deadline::after(kShortCopy));
  ASSERT_FALSE(received);
  EXPECT_EQ(received.error().code, Errc::timeout);
  EXPECT_THAT(received.error().what, HasSubstr("not done in time"));
  EXPECT_TRUE(is_gone(process));
}

TEST(ProcessCopy, OneThatSendsWithoutEndIsKilledAtItsDeadline) {
  auto copy = ProcessCopy::start([](const ProcessCopy::Send& send) {
    const std::array<char, 4096> bytes{};
    for (;;) send(bytes.data(), bytes.size());
  });
  ASSERT_TRUE(copy);
  const pid_t process = copy->pid();
  const Deadline deadline = Deadline::after(kShortCopy);
  std::array<char, 4096> bytes{};
  Result<void> received;
  while (received) received = copy->receive(bytes.data(), bytes.size(), deadline);
  EXPECT_EQ(received.error().code, Errc::timeout);
  EXPECT_TRUE(is_gone(process));
}

TEST(ProcessCopy, HowItEndedIsTold) {
  const Error aborted = error_of([](const ProcessCopy::Send&) { std::abort(); });
  EXPECT_EQ(aborted.code, Errc::disconnected);
  EXPECT_THAT(aborted.what, HasSubstr("signal 6 (Aborted)"));
  const Error killed = error_of([](const ProcessCopy::Send&) { ::raise(SIGKILL); });
  EXPECT_THAT(killed.what, HasSubstr("signal 9 (Killed)"));
  const Error threw = error_of([](const ProcessCopy::Send&) { throw std::runtime_error("damaged"); });
  EXPECT_EQ(threw.code, Errc::disconnected);
  EXPECT_THAT(threw.what, HasSubstr("gave up"));
  const Error silent = error_of([](const ProcessCopy::Send&) {});
  EXPECT_THAT(silent.what, HasSubstr("before it had sent all"));
}

TEST(ProcessCopy, IsNoMoreWhenItsOwnerGoes) {
  pid_t process = -1;
  {
    const auto copy = ProcessCopy::start([](const ProcessCopy::Send&) { sleep_for(kLongCopy); });
    ASSERT_TRUE(copy);
    process = copy->pid();
    EXPECT_FALSE(is_gone(process));
  }
  EXPECT_TRUE(is_gone(process));
}

TEST(ProcessCopy, ACopyHasCopiesOfItsOwn) {
  auto copy = ProcessCopy::start([](const ProcessCopy::Send& send) {
    const CopiesHeldOff held;  // of no use in a copy, and no hindrance
    int sum = 0;
    for (int i = 1; i <= 3; ++i) {
      auto inner = ProcessCopy::start([i](const ProcessCopy::Send& inner_send) { inner_send(&i, sizeof i); });
      int came = 0;
      if (inner && inner->receive(&came, sizeof came, Deadline::after(Duration::from_ms(10'000)))) sum += came;
    }
    send(&sum, sizeof sum);
  });
  ASSERT_TRUE(copy) << copy.error().what;
  int sum = 0;
  const auto came = copy->receive(&sum, sizeof sum, Deadline::after(Duration::from_ms(30'000)));
  ASSERT_TRUE(came) << came.error().what;
  EXPECT_EQ(sum, 6);
}

TEST(ProcessCopy, NoneIsMadeWhileCopiesAreHeldOff) {
  std::atomic<bool> made = false;
  std::optional<CopiesHeldOff> held(std::in_place);
  const OwnedThread maker([&](const std::stop_token&) {
    const auto copy = ProcessCopy::start([](const ProcessCopy::Send&) {});
    made = true;
    EXPECT_TRUE(copy);
  });
  sleep_for(kShortCopy);
  EXPECT_FALSE(made);
  held.reset();
}

}  // namespace
}  // namespace birdseye
