#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <utility>

#include "calibration/time/clock.hpp"

namespace birdseye::host {

/// By how much the tracker's noise throws a target about in the camera's frame, found from the poses as they come: each
/// of three in a row is compared with the line between its neighbours, which a hand's motion follows to some hundredths
/// of a millimetre. The sensor's angle counts with the lever that it really has.
class TargetJitter {
 public:
  /// Times go up; after a gap it begins anew.
  void push(DeviceTime acquired, const Eigen::Vector3d& target_in_camera_mm);
  /// Of a single pose, as the length of the error in space, root mean square over the newest poses. Empty before there
  /// are enough.
  [[nodiscard]] std::optional<double> rms_mm() const;
  /// How fast the target goes in the camera's frame, by a line through the poses of the newest fifth of a second. Empty
  /// before there are enough.
  [[nodiscard]] std::optional<double> speed_mm_s() const;

 private:
  std::deque<std::pair<DeviceTime, Eigen::Vector3d>> newest_;  ///< three at most
  std::deque<double> squares_mm2_;
  std::deque<std::pair<DeviceTime, Eigen::Vector3d>> track_;  ///< of the newest fifth of a second
};

}  // namespace birdseye::host
