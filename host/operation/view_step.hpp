#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "calibration/time/pose_history.hpp"
#include "device/wire/messages.hpp"
#include "host/operation/live_step.hpp"
#include "host/overlay/scope_setup.hpp"
#include "host/registration/views/view_advice.hpp"

namespace birdseye::host {

inline constexpr std::size_t kEnoughViews = 5;

/// A frame that the CT is matched with.
struct KeptView {
  wire::VideoFrame frame;
  Transform<Camera, Patient> camera_from_patient;
};

/// The views of the organ that are kept.
class ViewStep {
 public:
  ViewStep();

  /// The newest frame, with where its overlay was drawn from; empty where none was. A view from where a kept one was
  /// taken is refused: it tells no depth.
  void keep(const std::optional<wire::VideoFrame>& frame,
            const std::optional<Transform<Camera, Patient>>& camera_from_patient);
  /// Why keep() would refuse it, in words; empty: it would not.
  [[nodiscard]] std::string why_refused(const std::optional<Transform<Camera, Patient>>& camera_from_patient) const;
  /// A measurement of the scope's bird.
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  /// Gives each kept view the pose on which the measurements before and after its frame agree, as soon as they have
  /// come: a single measurement's noise is averaged away.
  void average(const Setup& setup);
  void undo();
  /// All of them; why in words.
  void forget(const std::string& why);

  [[nodiscard]] const std::vector<KeptView>& views() const { return views_; }
  [[nodiscard]] const StepNote& note() const { return note_; }
  /// Of one more from where the camera is now.
  [[nodiscard]] ViewAdvice advice(const Transform<Camera, Patient>& now, const Eigen::Vector3d& middle_mm) const;

 private:
  PoseHistory scope_;
  std::vector<KeptView> views_;
  std::size_t averaged_ = 0;  ///< of views_, from the first on
  StepNote note_;
};

}  // namespace birdseye::host
