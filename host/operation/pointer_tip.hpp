#pragma once

#include <Eigen/Core>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "device/wire/messages.hpp"
#include "host/registration/rigid/touch_detector.hpp"

namespace birdseye::host {

/// What was seen longer ago tells nothing of where the tip is.
inline constexpr Duration kPointerIsSeen = Duration::from_ms(500);

/// Follows the tip of the tracked pointer: where it is, and where it rests.
class PointerTip {
 public:
  /// pointer: the bird's name. A touch is told when the tip leaves the place at which it rested.
  std::optional<Touch> take(const wire::Birds& birds, const std::string& pointer,
                            const Eigen::Vector3d& tip_in_pointer_mm);
  /// The tip's mean of the last quarter of a second: a touch at once, by key or pedal. Empty where too little was seen.
  [[nodiscard]] std::optional<Touch> held() const;
  /// The newest place; empty where the pointer was not seen within the last quarter of a second of the birds' records.
  [[nodiscard]] std::optional<Eigen::Vector3d> in_tracker_mm() const;

 private:
  TouchDetector detector_;
  std::deque<std::pair<DeviceTime, Eigen::Vector3d>> newest_;  ///< of the last quarter of a second
};

}  // namespace birdseye::host
