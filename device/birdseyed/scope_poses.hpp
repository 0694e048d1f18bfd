#pragma once

#include <condition_variable>
#include <mutex>
#include <stop_token>

#include "calibration/time/pose_history.hpp"

namespace birdseye::device {

/// The scope's poses, between the thread that reads the tracker and the one that pairs frames.
class ScopePoses {
 public:
  explicit ScopePoses(const PoseHistory::Settings& settings) : settings_(settings), history_(settings) {}

  /// Keeps no pose whose time is not known to 10 ms: a laparoscope moves a millimetre in that.
  void push(DeviceTime acquired, Duration acquired_sigma, const Transform<Tracker, Sensor>& tracker_from_sensor);
  /// The pose at `time`. Waits, no longer than `deadline`, for the samples after it that its smoothing wants.
  PoseAnswer at(DeviceTime time, DeviceTime deadline, const std::stop_token& stop);

 private:
  PoseHistory::Settings settings_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  PoseHistory history_;
};

}  // namespace birdseye::device
