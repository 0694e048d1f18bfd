#include "host/overlay/gate.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace birdseye::host {

std::string OverlayGate::doubt(const PoseAnswer& pose) const {
  if (!pose.tracker_from_sensor) return pose.reason.empty() ? "no pose" : pose.reason;
  const Calibration& c = calibration_;
  if (!(c.camera_rms_px <= settings_.most_camera_rms_px))
    return fmt::format("the camera is calibrated to {:.1f} px only", c.camera_rms_px);
  if (!(c.tracked_rms_px <= settings_.most_tracked_rms_px))
    return fmt::format("hand-eye is off by {:.1f} px", c.tracked_rms_px);
  if (!(c.fre_mm <= settings_.most_fre_mm)) return fmt::format("the fiducials fit to {:.1f} mm only", c.fre_mm);
  if (!(c.target_mm <= settings_.most_target_mm))
    return fmt::format("fiducials as these leave the target open by {:.0f} mm: touch others, round about it",
                       c.target_mm);
  if (pose.kind == PoseKind::predicted && pose.age > settings_.most_predicted) {
    return fmt::format("the pose is predicted {:.0f} ms ahead", pose.age.seconds() * 1e3);
  }
  if (!(pose.position_sigma_mm <= settings_.most_sigma_mm)) {
    return fmt::format("the tracker scatters by {:.1f} mm", pose.position_sigma_mm);
  }
  return {};
}

OverlayGate::Decision OverlayGate::decide(DeviceTime time, const PoseAnswer& pose) {
  Decision decision;
  decision.reason = doubt(pose);
  const double target = decision.reason.empty() ? 1.0 : 0.0;
  // The first frame has nothing to fade from.
  const double most = last_ ? std::max(0.0, (time - *last_).seconds()) / settings_.fade.seconds() : 1.0;
  last_ = time;
  strength_ += std::clamp(target - strength_, -most, most);
  decision.strength = strength_;
  decision.tracker_from_sensor = pose.tracker_from_sensor;
  if (!pose.tracker_from_sensor) decision.strength = 0;
  return decision;
}

}  // namespace birdseye::host
