#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_parameters.hpp"

namespace birdseye::host {

/// camera_covariance (9x9: fx fy cx cy in px, k1 k2 p1 p2 k3) of a camera file in OpenCV's YAML, as `calibrate camera`
/// writes it. Empty where the file holds none or is of another program; an error where it holds another matrix, or one
/// with a variance below zero.
Result<std::optional<CameraMatrix>> read_camera_covariance(const std::filesystem::path& path);
/// What to append to camera_text.
std::string camera_covariance_text(const CameraMatrix& covariance);

}  // namespace birdseye::host
