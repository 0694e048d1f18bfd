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
  /// taken is refused: it tells no depth. So is one of a scope that moves fast: where its camera was is less sure.
  void keep(const std::optional<wire::VideoFrame>& frame,
            const std::optional<Transform<Camera, Patient>>& camera_from_patient, const std::optional<Setup>& setup);
  /// Why keep() would refuse it, in words; empty: it would not.
  [[nodiscard]] std::string why_refused(const std::optional<wire::VideoFrame>& frame,
                                        const std::optional<Transform<Camera, Patient>>& camera_from_patient,
                                        const std::optional<Setup>& setup) const;
  /// A measurement of the scope's bird.
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  /// Gives each kept view the pose on which the measurements before and after its frame agree, as soon as they have
  /// come: a single measurement's noise is averaged away. Lets a view go that was taken as the scope began to move
  /// fast.
  void average(const Setup& setup);
  void undo();
  /// All of them; why in words.
  void forget(const std::string& why);

  [[nodiscard]] const std::vector<KeptView>& views() const { return views_; }
  [[nodiscard]] const StepNote& note() const { return note_; }
  /// Of one more from where the camera is now.
  [[nodiscard]] ViewAdvice advice(const Transform<Camera, Patient>& now, const Eigen::Vector3d& middle_mm) const;

 private:
  [[nodiscard]] bool moved_fast(DeviceTime from, DeviceTime to, const Setup& setup) const;

  PoseHistory scope_;
  std::vector<KeptView> views_;
  std::size_t averaged_ = 0;  ///< of views_, from the first on
  StepNote note_;
};

}  // namespace birdseye::host
