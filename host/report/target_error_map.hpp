#pragma once

#include <optional>
#include <span>

#include "calibration/points/point_error.hpp"
#include "host/files/picture.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What a map of the predicted target error shows besides the error. Patient frame, mm.
struct TargetErrorScene {
  std::span<const Eigen::Vector3d> fiducials_mm, targets_mm;
  const Volume* ct = nullptr;  ///< drawn under the map; may be null
};

/// Three slices through the first target, or through where the error is least, with lines of equal error. The tint is
/// the brighter the larger the error, up to 5 mm.
Picture draw_target_error(const calibration::TargetError& error, const TargetErrorScene& scene);

/// The error over the patient's tissue (over -300 HU).
struct TargetErrorRange {
  double least_mm = 0, median_mm = 0, p95_mm = 0, most_mm = 0;
};
std::optional<TargetErrorRange> target_error_range(const calibration::TargetError& error, const Volume& ct);

}  // namespace birdseye::host
