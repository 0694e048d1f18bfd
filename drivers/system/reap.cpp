#include "drivers/system/reap.hpp"

#include <sys/wait.h>

#include <cerrno>

#include "drivers/system/wait.hpp"

namespace birdseye {

std::optional<int> reap(pid_t child, Deadline deadline) {
  constexpr Duration kLook = Duration::from_ms(5);  // how soon its end is seen
  for (;;) {
    int status = 0;
    const pid_t ended = ::waitpid(child, &status, WNOHANG);
    if (ended == child) return status;
    if ((ended < 0 && errno != EINTR) || deadline.passed()) return std::nullopt;  // it is no child, or not any more
    sleep_for(kLook);
  }
}

}  // namespace birdseye
