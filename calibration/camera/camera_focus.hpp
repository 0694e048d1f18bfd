#pragma once

#include <optional>
#include <span>

#include "calibration/camera/camera_bundle.hpp"
#include "calibration/camera/camera_calibration.hpp"

namespace birdseye::calibration {

/// The focal lengths of the first half of the views, which come in the order in which they were taken, and of the
/// second half, each found alone. Empty where there are too few views for halves.
std::optional<FocalHalves> focal_halves_of(const CameraModel& camera, LensModel model,
                                           std::span<const BundleView> views);

}  // namespace birdseye::calibration
