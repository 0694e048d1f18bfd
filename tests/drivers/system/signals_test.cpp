#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include "drivers/system/interrupt.hpp"
#include "drivers/system/service_signals.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye {
namespace {

template <typename Holds>
bool comes_true(Holds holds) {
  for (const Deadline end = Deadline::after(Duration::from_ms(60'000)); !end.passed();) {
    if (holds()) return true;
    sleep_for(Duration::from_ms(1));
  }
  return false;
}

TEST(Interrupt, IsNotedAndDoesNotEndTheProgram) {
  const std::atomic<bool>& noted = note_interrupts();
  EXPECT_FALSE(noted);
  EXPECT_FALSE(interrupted());
  ::raise(SIGTERM);
  EXPECT_TRUE(noted);
  EXPECT_TRUE(interrupted());
}

TEST(ServiceSignals, AreTakenByTheThreadThatWaitsForThem) {
  ServiceSignals signals;
  EXPECT_FALSE(signals.take_reload());
  ::kill(::getpid(), SIGHUP);
  EXPECT_TRUE(comes_true([&] { return signals.take_reload(); }));
  EXPECT_FALSE(signals.take_reload());  // told once
  EXPECT_FALSE(signals.stop().stop_requested());
  ::kill(::getpid(), SIGINT);
  EXPECT_TRUE(comes_true([&] { return signals.stop().stop_requested(); }));
}

}  // namespace
}  // namespace birdseye
