#pragma once

#include <optional>
#include <string>

#include "calibration/time/pose_history.hpp"

namespace birdseye::host {

/// Decides whether an overlay may be drawn. A wrong overlay is worse than none: where the pose is not to be believed it
/// fades out and says why, and the video goes on.
class OverlayGate {
 public:
  struct Settings {
    Duration most_predicted = Duration::from_ms(40);  ///< how far ahead of its newest sample a pose may be
    double most_sigma_mm = 1.5;                       ///< of the pose's position
    Duration fade = Duration::from_ms(200);
    double most_camera_rms_px = 1.5, most_tracked_rms_px = 12, most_fre_mm = 5, most_target_mm = 8;
  };
  /// How well camera, hand-eye and patient are known. Zeros are perfect; what is not known must not be drawn with.
  struct Calibration {
    double camera_rms_px = 0, tracked_rms_px = 0, fre_mm = 0;
    double target_mm = 0;    ///< what the fiducials' error comes to at the target
    double hand_eye_mm = 0;  ///< the error of hand-eye, held out, at the working distance
  };
  struct Decision {
    double strength = 0;  ///< of the overlay, 0 to 1
    std::string reason;   ///< why it is not whole; empty where it is
    /// The pose to draw with, where there is one that may be drawn with. Without one nothing is drawn: a fading overlay
    /// keeps to poses of the frames it is drawn on.
    std::optional<Transform<Tracker, Sensor>> tracker_from_sensor;
  };

  OverlayGate() = default;
  explicit OverlayGate(const Settings& settings) : settings_(settings) {}

  void set_calibration(const Calibration& calibration) { calibration_ = calibration; }

  /// The decision for a frame acquired at time, with the pose that came with it. Times must not go back.
  Decision decide(DeviceTime time, const PoseAnswer& pose);

 private:
  [[nodiscard]] std::string doubt(const PoseAnswer& pose) const;

  Settings settings_;
  Calibration calibration_;
  std::optional<DeviceTime> last_;
  double strength_ = 0;
};

}  // namespace birdseye::host
