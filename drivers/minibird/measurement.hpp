#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/time/clock.hpp"
#include "drivers/minibird/protocol.hpp"

namespace birdseye::drivers::minibird {

/// Why a reading has no pose.
enum class DoubtKind : std::uint8_t {
  none,
  lost,                ///< its record did not come whole
  senseless,           ///< no rotation, or an impossible angle
  saturated,           ///< an all-zero matrix or quaternion: too close, or a strong field
  beyond_scale,        ///< a position at the end of its scale
  frozen,              ///< the same record again and again
  step,                ///< farther from the last than a sensor can move
  hemisphere_flip,     ///< at the negative of where it was
  hemisphere_border,   ///< so near the plane that it may flip
  outside_hemisphere,  ///< where a unit with our settings never reports
  unconfirmed,         ///< the first after a start or a gap
  line_noise,          ///< readings about it make no sense again and again: this one may be wrong unseen
  unmapped,            ///< outside the field map; found by whoever applies the map, never by the driver
};
inline constexpr std::size_t kDoubtKinds = 13;
std::string_view name_of(DoubtKind doubt);  ///< "hemisphere flip" and so on, for counters

/// One bird at one measurement: a pose, or why there is none.
struct BirdReading {
  std::optional<RecordPose> pose;
  std::string doubt = "its record was lost";  ///< in words; empty where there is a pose
  DoubtKind kind = DoubtKind::lost;
  std::uint8_t button = 0;
};

/// All birds at one measurement.
struct Measurement {
  DeviceTime acquired;
  Duration acquired_sigma;
  /// False while measurements may have been lost uncounted, or the unit's beat may have moved, and the arrival does not
  /// bound the time either. `acquired` may then be off by far more than its sigma.
  bool time_certain = true;
  DeviceTime arrived;              ///< of its last byte
  std::vector<BirdReading> birds;  ///< by address, 1 first
};

struct MiniBirdCounters {
  std::uint64_t measurements = 0;
  std::uint64_t lost_measurements = 0;  ///< that must have happened before, by the clock line
  std::uint64_t phase_errors = 0, discarded_bytes = 0, line_errors = 0, restarts = 0;
  std::uint64_t senseless_records = 0;               ///< all that decode_pose() refused
  std::array<std::uint64_t, kDoubtKinds> doubted{};  ///< readings, by DoubtKind
  [[nodiscard]] std::uint64_t of(DoubtKind doubt) const { return doubted[static_cast<std::size_t>(doubt)]; }
};

}  // namespace birdseye::drivers::minibird
