#include "drivers/system/monotonic.hpp"

#include <algorithm>
#include <ctime>

namespace birdseye::drivers {

DeviceTime now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return {time.tv_sec * std::int64_t{1'000'000'000} + time.tv_nsec};
}

int poll_ms(DeviceTime deadline) {
  const std::int64_t left_ns = (deadline - now()).ns;
  return static_cast<int>(std::clamp<std::int64_t>((left_ns + 999'999) / 1'000'000, 0, 60'000));
}

void sleep_until(DeviceTime time) {
  timespec until{};
  until.tv_sec = time.ns / 1'000'000'000;
  until.tv_nsec = time.ns % 1'000'000'000;
  clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr);
}

void sleep_for(Duration span) {
  timespec time{};
  time.tv_sec = span.ns / 1'000'000'000;
  time.tv_nsec = span.ns % 1'000'000'000;
  nanosleep(&time, nullptr);
}

bool sleep_for(Duration span, const std::stop_token& stop) {
  const DeviceTime until = now() + span;
  while (now() < until) {
    if (stop.stop_requested()) return false;
    sleep_for(std::min(until - now(), Duration::from_ms(20)));
  }
  return true;
}

}  // namespace birdseye::drivers
