#include "drivers/system/wait.hpp"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <mutex>
#include <stdexcept>

#include "drivers/system/condition.hpp"
#include "drivers/system/time_keeper.hpp"

namespace birdseye {

namespace {

timespec timespec_of(Duration span) {
  return {span.ns / 1'000'000'000, span.ns % 1'000'000'000};
}

}  // namespace

void sleep_until(Deadline deadline) {
  if (TimeKeeper* const keeper = TimeKeeper::present()) return keeper->sleep_until(deadline.ns_);
  const timespec until = timespec_of({std::max<std::int64_t>(0, deadline.ns_)});
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

void sleep_for(Duration span) {
  sleep_until(Deadline::after(span));
}

bool sleep_for(Duration span, const std::stop_token& stop) {
  std::mutex mutex;
  std::unique_lock lock(mutex);
  Condition never;
  never.wait(lock, stop, Deadline::after(span), [] { return false; });
  return !stop.stop_requested();
}

bool wait_ready(std::span<pollfd> entries, Deadline deadline) {
  // What the kernel has ready has no part in a simulator's time: links and lines are its own there.
  if (TimeKeeper::present() != nullptr) throw std::logic_error("a descriptor is waited for in a simulator's time");
  for (;;) {
    const timespec left = timespec_of(deadline.left());
    const int ready = ::ppoll(entries.data(), entries.size(), &left, nullptr);
    if (ready > 0) return true;
    if (ready == 0 || errno != EINTR) break;
  }
  for (pollfd& entry : entries) entry.revents = 0;
  return false;
}

short wait_ready(int fd, short events, Deadline deadline) {
  pollfd entry{fd, events, 0};
  return wait_ready(std::span(&entry, 1), deadline) ? entry.revents : short{0};
}

}  // namespace birdseye
