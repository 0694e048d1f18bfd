#include "host/overlay/gate.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace birdseye::host {

std::string OverlayGate::doubt_of_figures() const {
  const ScopeFigures& scope = figures_.scope;
  if (!scope.camera_rms_px) return "how well the camera is calibrated is not known";
  if (!(*scope.camera_rms_px <= settings_.most_camera_rms_px))
    return fmt::format("the camera is calibrated to {:.1f} px only", *scope.camera_rms_px);
  if (!scope.held_out_px) return "how far hand-eye is off is not known";
  if (!(*scope.held_out_px <= settings_.most_held_out_px))
    return fmt::format("hand-eye is off by {:.1f} px", *scope.held_out_px);
  if (!figures_.fre_mm) return "how well the fiducials fit is not known";
  if (!(*figures_.fre_mm <= settings_.most_fre_mm))
    return fmt::format("the fiducials fit to {:.1f} mm only", *figures_.fre_mm);
  if (!figures_.target_mm) return "how far the target may be off is not known";
  if (!(*figures_.target_mm <= settings_.most_target_mm))
    return fmt::format("fiducials as these leave the target open by {:.0f} mm: touch others, round about it",
                       *figures_.target_mm);
  return {};
}

std::string OverlayGate::doubt(const PoseAnswer& pose) const {
  if (!pose.tracker_from_sensor) return pose.reason.empty() ? "no pose" : pose.reason;
  if (std::string why = doubt_of_figures(); !why.empty()) return why;
  if (pose.kind == PoseKind::predicted && pose.age > settings_.most_predicted) {
    return fmt::format("the pose is predicted {:.0f} ms ahead", pose.age.seconds() * 1e3);
  }
  if (!(pose.position_sigma_mm <= settings_.most_sigma_mm)) {
    return fmt::format("the tracker scatters by {:.1f} mm", pose.position_sigma_mm);
  }
  return {};
}

std::string OverlayGate::doubt_of_motion() const {
  if (!figures_.moved_mm) return {};
  return fmt::format("the organ has moved since the views ({:.0f} mm): keep views anew (or undo the deformation)",
                     *figures_.moved_mm);
}

OverlayGate::Decision OverlayGate::decide(DeviceTime time, const PoseAnswer& pose) {
  Decision decision;
  decision.reason = doubt(pose);
  decision.believed = decision.reason.empty();
  if (decision.believed) decision.reason = doubt_of_motion();
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

OverlayGate::Decision decide_still(const TrustFigures& figures) {
  OverlayGate gate;
  gate.set_figures(figures);
  PoseAnswer exact;
  exact.kind = PoseKind::exact;
  exact.tracker_from_sensor.emplace();
  return gate.decide({}, exact);
}

}  // namespace birdseye::host
