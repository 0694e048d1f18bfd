#pragma once

#include <poll.h>

#include <span>
#include <stop_token>

#include "drivers/system/clock.hpp"

namespace birdseye {

void sleep_until(Deadline deadline);
void sleep_for(Duration span);
/// Or until stop is requested; false then.
bool sleep_for(Duration span, const std::stop_token& stop);

/// Waits until one of the entries is ready and fills in their revents. False: none was by the deadline. An entry whose
/// descriptor is negative is never ready.
bool wait_ready(std::span<pollfd> entries, Deadline deadline);
/// The same of one descriptor: its revents; 0: not ready by the deadline.
short wait_ready(int fd, short events, Deadline deadline);

}  // namespace birdseye
