#pragma once

#include <poll.h>

#include <cstdint>
#include <ctime>

namespace birdseye::hw_sim {

/// Waits for events of a descriptor (fd below 0: of none), at the latest until a time of CLOCK_MONOTONIC, as exactly as
/// the kernel can. now_ns: the time at the call.
inline bool wait_for_fd(int fd, short events, std::int64_t now_ns, std::int64_t until_ns) {
  const std::int64_t left_ns = until_ns > now_ns ? until_ns - now_ns : 0;
  const timespec timeout{left_ns / 1'000'000'000, left_ns % 1'000'000'000};
  pollfd entry{fd, events, 0};
  return ::ppoll(&entry, 1, &timeout, nullptr) > 0;
}

}  // namespace birdseye::hw_sim
