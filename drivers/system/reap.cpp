#include "drivers/system/reap.hpp"

#include <sys/wait.h>

#include "drivers/system/wait.hpp"

namespace birdseye {

std::optional<int> reap(pid_t child, Deadline deadline) {
  constexpr Duration kLook = Duration::from_ms(5);  // how soon its end is seen
  for (;;) {
    int status = 0;
    if (::waitpid(child, &status, WNOHANG) == child) return status;
    if (deadline.passed()) return std::nullopt;
    sleep_for(kLook);
  }
}

}  // namespace birdseye
