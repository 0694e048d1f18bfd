#include "host/bench/processor_time.hpp"

#include <time.h>

namespace birdseye::host {

namespace {

double used_s(clockid_t clock) {
  timespec used{};
  clock_gettime(clock, &used);
  return static_cast<double>(used.tv_sec) + 1e-9 * static_cast<double>(used.tv_nsec);
}

}  // namespace

double thread_cpu_s() {
  return used_s(CLOCK_THREAD_CPUTIME_ID);
}

double process_cpu_s() {
  return used_s(CLOCK_PROCESS_CPUTIME_ID);
}

}  // namespace birdseye::host
