#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "calibration/time/clock.hpp"
#include "device/wire/messages.hpp"
#include "host/overlay/followed_places.hpp"
#include "host/overlay/scope_setup.hpp"

namespace birdseye::host {

/// Whether the video has just moved other than the poses that its frames are drawn by. Each frame is held against that
/// of a fifth of a second before, at once: no later poses are waited for, so a single pose's noise counts in full, and
/// only what is plainly more is said. What is slower, or smaller, VideoMotion sees.
class SuddenMotion {
 public:
  SuddenMotion();
  ~SuddenMotion();
  SuddenMotion(SuddenMotion&&) noexcept;
  SuddenMotion& operator=(SuddenMotion&&) noexcept;

  /// A pose of the scope's sensor, as they come: how they scatter is measured by them.
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  /// A frame, as they come, that frame small and grey, and the scope that took it. target_mm: how far from the camera
  /// the target is drawn; of what is seen about it, half lies no more than twice as far. Empty: it is not drawn. True:
  /// the video has moved otherwise, or shows another scene.
  bool take(const wire::VideoFrame& frame, const PictureToFollow& picture, const ScopeSetup& scope,
            std::optional<double> target_mm);

 private:
  struct Seen;
  struct Tracks;
  [[nodiscard]] std::optional<Seen> seen(const wire::VideoFrame& frame, const ScopeSetup& scope) const;
  [[nodiscard]] bool differs(const Seen& now) const;
  [[nodiscard]] double scatter() const;

  std::optional<ScopeSetup> of_;                                          ///< that the last frame was taken with
  std::deque<std::pair<DeviceTime, Transform<Tracker, Sensor>>> newest_;  ///< three poses at most
  std::deque<double> squares_;      ///< of the newest poses, how far each is off the line between its neighbours
  std::unique_ptr<Tracks> tracks_;  ///< what is followed
};

}  // namespace birdseye::host
