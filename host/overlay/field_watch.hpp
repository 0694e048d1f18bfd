#pragma once

#include <optional>

#include "calibration/picture/field_edge.hpp"
#include "calibration/time/clock.hpp"
#include "device/wire/messages.hpp"
#include "host/overlay/scope_setup.hpp"

namespace birdseye::host {

/// Whether the video's round field is as large as when the lens was calibrated: a lens that is zoomed shows another,
/// and nothing else in the picture tells it. Looked at five times a second; two pictures in a row have to say the same.
class FieldWatch {
 public:
  /// A frame, as they come, and the scope that took it. True: state() is another now.
  bool take(const wire::VideoFrame& frame, const ScopeSetup& scope);
  /// What was said last. cannot_tell: nothing yet, or the calibration's pictures showed no edge.
  [[nodiscard]] calibration::FieldSize state() const { return state_; }

 private:
  std::optional<RoundField> of_;
  std::optional<DeviceTime> looked_at_;
  calibration::FieldSize state_ = calibration::FieldSize::cannot_tell, last_ = state_;
};

}  // namespace birdseye::host
