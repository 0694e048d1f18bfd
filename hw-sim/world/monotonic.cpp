#include "hw-sim/world/monotonic.hpp"

#include <ctime>

namespace birdseye::hw_sim {

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * std::int64_t{1'000'000'000} + now.tv_nsec;
}

void sleep_until_ns(std::int64_t time_ns) {
  timespec until{};
  until.tv_sec = time_ns / 1'000'000'000;
  until.tv_nsec = time_ns % 1'000'000'000;
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

}  // namespace birdseye::hw_sim
