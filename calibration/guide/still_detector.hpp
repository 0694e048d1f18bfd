#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "calibration/base/units.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/time/clock.hpp"

namespace birdseye::calibration {

struct StillSettings {
  Duration kept = Duration::from_ms(1500);  ///< poses of the past that are remembered
  Duration before = Duration::from_ms(60);  ///< of the moment asked about: the window that is looked at
  Duration after = Duration::from_ms(40);   ///< poses have to have come in up to here
  // More than the motion fitted to a noisy tracker at rest; a move to another station is many times as much.
  double still_mm = 3, still_rad = 1.0 * kRadPerDeg;
};

/// A stretch of rest, averaged.
struct Rest {
  Transform<Tracker, Sensor> tracker_from_sensor;
  std::size_t samples = 0;
  // Of one sample about the mean, per axis, summed over the samples.
  double position_squares_mm2 = 0, angle_squares_rad2 = 0;
};

/// Says from a stream of poses when the scope was held still. A picture and a pose of such a time belong together,
/// however their clocks differ.
class StillDetector {
 public:
  explicit StillDetector(const StillSettings& settings = {}) : settings_(settings) {}

  /// In the order of time. A pose that is not finite is passed over.
  void push(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  /// Whether the sensor was at rest around this time. False where either half of the window has fewer than two poses,
  /// as when the poses have not come in yet.
  [[nodiscard]] bool still_at(DeviceTime time) const;
  /// The mean of the poses from first to last, both included. Empty where they are fewer than four.
  [[nodiscard]] std::optional<Rest> rest_between(DeviceTime first, DeviceTime last) const;

 private:
  struct Sample {
    DeviceTime acquired;
    Transform<Tracker, Sensor> pose;
  };
  StillSettings settings_;
  std::deque<Sample> recent_;
};

}  // namespace birdseye::calibration
