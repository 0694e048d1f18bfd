#include "host/overlay/gate.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/texts/texts.hpp"

namespace birdseye::host {

std::string OverlayGate::doubt_of_figures() const {
  const ScopeFigures& scope = figures_.scope;
  if (scope.rod_angle_missing) return words("why_rod_angle");
  if (!scope.camera_rms_px) return words("why_camera_unknown");
  if (!(*scope.camera_rms_px <= settings_.most_camera_rms_px)) return words("why_camera_rms", *scope.camera_rms_px);
  if (!scope.held_out_px) return words("why_hand_eye_unknown");
  if (!(*scope.held_out_px <= settings_.most_held_out_px)) return words("why_hand_eye_off", *scope.held_out_px);
  if (!figures_.fre_mm) return words("why_fre_unknown");
  if (!(*figures_.fre_mm <= settings_.most_fre_mm)) return words("why_fre", *figures_.fre_mm);
  if (!figures_.target_mm) return words("why_target_unknown");
  if (!(*figures_.target_mm <= settings_.most_target_mm)) return words("why_target", *figures_.target_mm);
  return {};
}

std::string OverlayGate::doubt(const PoseAnswer& pose, const std::optional<ErrorBudget>& expected) const {
  if (!pose.tracker_from_sensor) return pose.reason.empty() ? words("why_no_pose") : pose.reason;
  if (std::string why = doubt_of_figures(); !why.empty()) return why;
  if (figures_.field == calibration::FieldSize::larger) return words("why_zoomed_in");
  if (figures_.field == calibration::FieldSize::smaller) return words("why_zoomed_out");
  if (figures_.video == VideoAgreement::differs) return words("why_video_differs");
  if (figures_.video == VideoAgreement::untold || figures_.video == VideoAgreement::in_doubt)
    return words("why_video_untold");
  if (pose.kind == PoseKind::predicted && pose.age > settings_.most_predicted) {
    return words("why_predicted", pose.age.seconds() * 1e3);
  }
  if (!(pose.position_sigma_mm <= settings_.most_sigma_mm)) {
    return words("why_scatter", pose.position_sigma_mm);
  }
  if (expected && !(expected->rms_mm() <= settings_.most_target_mm)) return words("why_error", expected->rms_mm());
  return {};
}

std::string OverlayGate::doubt_of_motion() const {
  if (!figures_.moved_mm) return {};
  return words("why_moved", *figures_.moved_mm);
}

OverlayGate::Decision OverlayGate::decide(DeviceTime time, const PoseAnswer& pose,
                                          const std::optional<ErrorBudget>& expected) {
  Decision decision;
  decision.expected = expected;
  decision.reason = doubt(pose, expected);
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
