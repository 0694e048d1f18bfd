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

  void push(DeviceTime acquired, Duration sigma, const Transform<Tracker, Sensor>& tracker_from_sensor);
  /// The pose at `time`. Waits, no longer than `deadline`, for the samples after it that its smoothing wants.
  PoseAnswer at(DeviceTime time, DeviceTime deadline, const std::stop_token& stop);

 private:
  PoseHistory::Settings settings_;
  std::mutex mutex_;
  std::condition_variable_any changed_;
  PoseHistory history_;
};

}  // namespace birdseye::device
