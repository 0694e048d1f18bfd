#pragma once

#include <algorithm>
#include <cmath>
#include <compare>
#include <cstdint>

namespace birdseye {

/// How far from zero an instant may be, and how long a span, where either comes from outside: 73 years. Times since
/// 1970 are within until 2043, and three of them can be added or subtracted without overflow.
inline constexpr std::int64_t kFarthest_ns = std::int64_t{1} << 61;

/// A span of time, ns. One type for both clocks: their rates differ by parts per million, which clock lines estimate.
struct Duration {
  std::int64_t ns = 0;
  auto operator<=>(const Duration&) const = default;
  [[nodiscard]] double seconds() const { return static_cast<double>(ns) * 1e-9; }
  /// seconds: one that is longer than kFarthest_ns becomes as long as that.
  static Duration from_seconds(double seconds) {
    constexpr auto kFarthest = static_cast<double>(kFarthest_ns);
    return {static_cast<std::int64_t>(std::min(std::max(-kFarthest, seconds * 1e9), kFarthest))};
  }
  static constexpr Duration from_ms(std::int64_t ms) { return {ms * 1'000'000}; }
  Duration operator+(Duration other) const { return {ns + other.ns}; }
  Duration operator-(Duration other) const { return {ns - other.ns}; }
};

/// The sigma of two independent errors together.
inline Duration in_quadrature(Duration a, Duration b) {
  return {std::llround(std::hypot(static_cast<double>(a.ns), static_cast<double>(b.ns)))};
}

/// An instant on one machine's CLOCK_MONOTONIC. Clock is a tag: instants of different clocks do not mix.
template <typename Clock>
struct Instant {
  std::int64_t ns = 0;
  auto operator<=>(const Instant&) const = default;
  Duration operator-(Instant other) const { return {ns - other.ns}; }
  Instant operator+(Duration span) const { return {ns + span.ns}; }
  Instant operator-(Duration span) const { return {ns - span.ns}; }
};

struct DeviceClock;  ///< the appliance's CLOCK_MONOTONIC
struct HostClock;    ///< the host's CLOCK_MONOTONIC
using DeviceTime = Instant<DeviceClock>;
using HostTime = Instant<HostClock>;

/// A sample with its acquisition time (when the world was as the sample says), that time's sigma, and its arrival time.
template <typename T>
struct Stamped {
  T value;
  DeviceTime acquired;
  Duration acquired_sigma;
  DeviceTime arrived;
};

}  // namespace birdseye
