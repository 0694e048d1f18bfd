#pragma once

#include <compare>
#include <cstdint>
#include <string>

#include "calibration/time/clock.hpp"

namespace birdseye {

// Clocks are read here and nowhere else. A machine has one CLOCK_MONOTONIC; who reads it says which machine it is.

/// CLOCK_MONOTONIC of this machine, the appliance: for drivers, the appliance's daemon and simulated instruments.
DeviceTime device_now();
/// CLOCK_MONOTONIC of this machine, the host.
HostTime host_now();
/// By how much the time of day is ahead of CLOCK_MONOTONIC.
Duration wall_minus_monotonic();
/// How long this machine has slept since it was started: CLOCK_MONOTONIC stood still then.
Duration time_asleep();
/// The time of day, UTC, as "2026-11-22T22:51:36Z".
std::string utc_now();
/// The time of day where this machine is, as "2026-11-22T23:51".
std::string local_time_now();

/// The moment at which a wait ends, on this machine's clock. Every wait takes this one type, for the same waits serve
/// appliance and host: the former gives a DeviceTime, the latter a HostTime. Neither comes out again, so a time of one
/// machine never becomes a time of the other by way of a deadline; and no number or Duration is taken for one.
class Deadline {
 public:
  Deadline(DeviceTime time) : ns_(time.ns) {}
  Deadline(HostTime time) : ns_(time.ns) {}
  static Deadline after(Duration span);

  [[nodiscard]] bool passed() const { return left().ns == 0; }
  /// Until then; 0 once it has passed.
  [[nodiscard]] Duration left() const;
  auto operator<=>(const Deadline&) const = default;

 private:
  friend void sleep_until(Deadline deadline);
  friend class Condition;
  std::int64_t ns_;
};

}  // namespace birdseye
