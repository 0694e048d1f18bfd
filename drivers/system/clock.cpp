#include "drivers/system/clock.hpp"

#include <fmt/chrono.h>

#include <ctime>

#include "drivers/system/time_keeper.hpp"

namespace birdseye {

namespace {

std::int64_t read_ns(clockid_t clock) {
  if (TimeKeeper* const keeper = TimeKeeper::present())
    return clock == CLOCK_REALTIME ? keeper->realtime_ns() : keeper->monotonic_ns();
  timespec time{};
  clock_gettime(clock, &time);
  return time.tv_sec * std::int64_t{1'000'000'000} + time.tv_nsec;
}

}  // namespace

DeviceTime device_now() {
  return {read_ns(CLOCK_MONOTONIC)};
}

HostTime host_now() {
  return {read_ns(CLOCK_MONOTONIC)};
}

Duration wall_minus_monotonic() {
  const std::int64_t wall_ns = read_ns(CLOCK_REALTIME);
  return {wall_ns - read_ns(CLOCK_MONOTONIC)};
}

Duration time_asleep() {
  if (TimeKeeper::present() != nullptr) return {0};  // where time is simulated nobody sleeps
  const std::int64_t booted_ns = read_ns(CLOCK_BOOTTIME);
  return {booted_ns - read_ns(CLOCK_MONOTONIC)};
}

std::string utc_now() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time_t{read_ns(CLOCK_REALTIME) / 1'000'000'000}));
}

std::string local_time_now() {
  return fmt::format("{:%Y-%m-%dT%H:%M}", fmt::localtime(std::time_t{read_ns(CLOCK_REALTIME) / 1'000'000'000}));
}

Deadline Deadline::after(Duration span) {
  return device_now() + span;
}

Duration Deadline::left() const {
  const std::int64_t now_ns = read_ns(CLOCK_MONOTONIC);
  return {ns_ > now_ns ? ns_ - now_ns : 0};
}

}  // namespace birdseye
