#include "drivers/system/thread.hpp"

#include <pthread.h>
#include <sched.h>

namespace birdseye {

bool schedule_this_thread_real_time() {
  if (TimeKeeper::present() != nullptr) return false;
  const sched_param least{.sched_priority = 1};
  return ::pthread_setschedparam(::pthread_self(), SCHED_RR, &least) == 0;
}

}  // namespace birdseye
