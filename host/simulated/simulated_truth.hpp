#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// The truth, which the simulator knows and only reports read.
struct SimulatedTruth {
  /// How it is while a frame is exposed: the patient may have moved, the liver with the breath, and the lens may have
  /// been zoomed.
  struct Frame {
    CameraModel camera;
    Transform<Camera, Patient> camera_from_patient;
    Eigen::Vector3d tumour_centre_in_patient_mm;  ///< deformed, where the liver is
  };
  std::map<std::uint64_t, Frame> frames;  ///< by sequence
};

/// How far an overlay puts the tumour's centre from where it truly is.
struct OverlayError {
  double target_mm = 0, overlay_px = 0;
  /// The tumour's centre in the picture, where it truly is and where the overlay puts it; both or none.
  std::optional<std::pair<Eigen::Vector2d, Eigen::Vector2d>> true_and_overlaid_px;
};
/// The error of one frame's overlay, drawn with this lens from this pose. tumour_in_patient_mm: where the CT that is
/// drawn shows the tumour. Empty where the truth knows no such frame.
std::optional<OverlayError> overlay_error(const SimulatedTruth& truth, std::uint64_t sequence,
                                          const CameraModel& camera,
                                          const Transform<Camera, Patient>& camera_from_patient,
                                          const Eigen::Vector3d& tumour_in_patient_mm);

/// Reads the truth. folder: the simulator's truth/.
Result<SimulatedTruth> read_simulated_truth(const std::filesystem::path& folder);

}  // namespace birdseye::host
