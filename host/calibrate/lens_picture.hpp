#pragma once

#include <string>

#include "calibration/geometry/camera_model.hpp"

namespace birdseye::host {

/// An SVG of the picture's frame with straight lines of the world as the lens shows them, the lens's centre, and the
/// largest distance in the picture between where a place is shown and where a lens without distortion would show it.
/// Lines end where the lens folds.
std::string lens_picture_svg(const CameraModel& camera);

}  // namespace birdseye::host
