#pragma once

#include <stop_token>

#include "calibration/time/clock.hpp"

namespace birdseye::drivers {

/// CLOCK_MONOTONIC of this machine.
DeviceTime now();
/// Milliseconds until deadline for poll(): at least 0, rounded up.
int poll_ms(DeviceTime deadline);
void sleep_for(Duration span);
/// Or until stop is requested, as it looks for every few ms; false then.
bool sleep_for(Duration span, const std::stop_token& stop);
void sleep_until(DeviceTime time);

}  // namespace birdseye::drivers
