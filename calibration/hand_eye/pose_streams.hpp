#pragma once

#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"

namespace birdseye::calibration {

/// Poses of two instruments on one rigid body, each on a clock of its own.
struct StampedSensor {
  double time_s = 0;
  Transform<Tracker, Sensor> tracker_from_sensor;
};
struct StampedView {
  double time_s = 0;
  Transform<Camera, Marker> camera_from_marker;
};

struct StreamPairing {
  double offset_s = 0;     ///< a picture of time t shows what the tracker's stream has at t + offset
  double correlation = 0;  ///< of the two angular speeds there
  /// Pictures far enough apart, each with the tracker's motion and its pose interpolated at the picture's time +
  /// offset: input for calibrate_hand_eye. The time offset found there adds to this one.
  std::vector<HandEyeStation> stations;
};

/// Finds the clocks' offset, up to 2 s either way, where the angular speeds correlate best: both instruments turn
/// equally fast, whatever hand-eye is. Refuses streams that do not overlap, do not move, or do not correlate.
/// Both streams must be in the order of their times.
Result<StreamPairing> pair_pose_streams(std::span<const StampedSensor> sensor, std::span<const StampedView> views);

}  // namespace birdseye::calibration
