#include "device/birdseyed/scope_poses.hpp"

#include <chrono>

#include "drivers/io/monotonic.hpp"

namespace birdseye::device {

void ScopePoses::push(DeviceTime acquired, Duration sigma, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  {
    const std::lock_guard lock(mutex_);
    history_.push(acquired, sigma, tracker_from_sensor);
  }
  changed_.notify_all();
}

PoseAnswer ScopePoses::at(DeviceTime time, DeviceTime deadline, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto covered = [&] {
    const auto newest = history_.newest();
    return newest && *newest >= time + settings_.smoothing;
  };
  const std::int64_t patience_ns = (deadline - drivers::now()).ns;
  if (patience_ns > 0) changed_.wait_for(lock, stop, std::chrono::nanoseconds(patience_ns), covered);
  return history_.at(time);
}

}  // namespace birdseye::device
