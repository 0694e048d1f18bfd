#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/geometry/transform.hpp"
#include "device/wire/messages.hpp"
#include "host/operation/live_step.hpp"
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
  /// The newest frame, with where its overlay was drawn from; empty where none was.
  void keep(const std::optional<wire::VideoFrame>& frame,
            const std::optional<Transform<Camera, Patient>>& camera_from_patient);
  void undo();
  /// All of them; why in words.
  void forget(const std::string& why);

  [[nodiscard]] const std::vector<KeptView>& views() const { return views_; }
  [[nodiscard]] const StepNote& note() const { return note_; }
  /// Of one more from where the camera is now.
  [[nodiscard]] ViewAdvice advice(const Transform<Camera, Patient>& now, const Eigen::Vector3d& middle_mm) const;

 private:
  std::vector<KeptView> views_;
  StepNote note_;
};

}  // namespace birdseye::host
