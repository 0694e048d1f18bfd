#pragma once

#include "calibration/time/clock.hpp"

namespace birdseye::drivers {

/// CLOCK_MONOTONIC of this machine.
DeviceTime now();
/// Milliseconds until deadline for poll(): at least 0, rounded up.
int poll_ms(DeviceTime deadline);
void sleep_for(Duration span);
void sleep_until(DeviceTime time);

}  // namespace birdseye::drivers
