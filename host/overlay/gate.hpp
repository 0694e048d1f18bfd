#pragma once

#include <optional>
#include <string>

#include "calibration/time/pose_history.hpp"
#include "host/overlay/trust.hpp"

namespace birdseye::host {

/// Decides whether an overlay may be drawn. A wrong overlay is worse than none: where the pose is not to be believed it
/// fades out and says why, and the video goes on.
class OverlayGate {
 public:
  struct Settings {
    Duration most_predicted = Duration::from_ms(40);  ///< how far ahead of its newest sample a pose may be
    double most_sigma_mm = 1.5;                       ///< of the pose's position
    Duration fade = Duration::from_ms(200);
    double most_camera_rms_px = 1.5, most_held_out_px = 12, most_fre_mm = 5;
    double most_target_mm = 8;  ///< of the error to be expected there: by the fiducials, and by all that is counted
  };
  struct Decision {
    double strength = 0;  ///< of the overlay, 0 to 1
    std::string reason;   ///< why it is not whole; empty where it is
    /// Pose, lens, hand-eye and registration are to be believed, though the organ may have moved since: nothing may be
    /// drawn by them then, but the video may be held against what is known.
    bool believed = false;
    /// The pose to draw with, where there is one that may be drawn with. Without one nothing is drawn: a fading overlay
    /// keeps to poses of the frames it is drawn on.
    std::optional<Transform<Tracker, Sensor>> tracker_from_sensor;
    std::optional<ErrorBudget> expected;  ///< of the target; empty: it is not known, or there is no pose
  };

  OverlayGate() = default;
  explicit OverlayGate(const Settings& settings) : settings_(settings) {}

  /// Before them nothing is known, and nothing is drawn.
  void set_figures(const TrustFigures& figures) { figures_ = figures; }

  /// The decision for a frame acquired at time, with the pose that came with it, and the error that is to be expected
  /// of the target. Times must not go back.
  Decision decide(DeviceTime time, const PoseAnswer& pose, const std::optional<ErrorBudget>& expected = std::nullopt);

 private:
  [[nodiscard]] std::string doubt_of_figures() const;
  [[nodiscard]] std::string doubt(const PoseAnswer& pose, const std::optional<ErrorBudget>& expected) const;
  [[nodiscard]] std::string doubt_of_motion() const;

  Settings settings_;
  TrustFigures figures_;
  std::optional<DeviceTime> last_;
  double strength_ = 0;
};

/// For a still, of which somebody gives lens and pose: the decision on a pose that is exact.
OverlayGate::Decision decide_still(const TrustFigures& figures);

}  // namespace birdseye::host
