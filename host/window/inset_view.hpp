#pragma once

#include <optional>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/files/picture.hpp"
#include "host/render/scene/scene.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// The CT from outside with the scope in it: where the laparoscope is, and which way it looks.
class InsetView {
 public:
  static constexpr int kWidthPx = 280, kHeightPx = 210;

  /// Looks at the volume's middle from the patient's front, a little from the left and from above.
  explicit InsetView(const Volume& volume);

  // From where the CT is to be drawn.
  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  [[nodiscard]] const Transform<Camera, Patient>& outside_from_patient() const { return outside_from_patient_; }
  [[nodiscard]] static RenderSettings render_settings();

  /// ct: drawn from there. camera_from_patient: the scope's; empty: it is not known, and not drawn.
  [[nodiscard]] Picture draw(const ImageRgba& ct,
                             const std::optional<Transform<Camera, Patient>>& camera_from_patient) const;

 private:
  CameraModel camera_;
  Transform<Camera, Patient> outside_from_patient_;
};

}  // namespace birdseye::host
