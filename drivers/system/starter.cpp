#include "drivers/system/starter.hpp"

#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye {

namespace {

constexpr Duration kLook = Duration::from_ms(200);    // how soon the thread sees that it is to stop
constexpr Duration kGrace = Duration::from_ms(2000);  // as ChildProcess grants it

}  // namespace

OwnedThread end_with_standard_input() {
  return OwnedThread([](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      if (!wait_ready(STDIN_FILENO, POLLIN, Deadline::after(kLook))) continue;
      std::array<char, 256> thrown_away{};
      const ssize_t got = ::read(STDIN_FILENO, thrown_away.data(), thrown_away.size());
      if (got > 0 || (got < 0 && (errno == EINTR || errno == EAGAIN))) continue;
      ::kill(::getpid(), SIGTERM);
      sleep_for(kGrace, stop);
      if (!stop.stop_requested()) ::kill(::getpid(), SIGKILL);
      return;
    }
  });
}

}  // namespace birdseye
