#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// A lens, from any of:
/// - OpenCV's YAML or XML: image_width, image_height, camera_matrix (3x3), distortion_coefficients (k1 k2 p1 p2 [k3]);
/// - ROS' camera_info, as files have it (image_width, camera_matrix, distortion_model) or as the message does (width,
/// k,
///   d): plumb_bob, and rational_polynomial whose further terms are 0;
/// - Kalibr's camchain: pinhole with radtan or none. Of several cameras path names one behind a colon:
/// camchain.yaml:cam1. Refuses, naming the file, a model that this one cannot say, a skew, and numbers that are no
/// lens.
Result<CameraModel> read_camera(const std::filesystem::path& path);

/// The text that read_camera reads back exactly, in OpenCV's YAML.
std::string camera_text(const CameraModel& camera);
/// The same as ROS' camera_info, for a camera of that name.
std::string ros_camera_text(const CameraModel& camera, const std::string& name);
/// The same as Kalibr's camchain. Refuses a lens with k3, which radtan has not.
Result<std::string> kalibr_text(const CameraModel& camera);
/// Two cameras of one Kalibr camchain: cam0 and cam1.
Result<std::string> kalibr_text(const CameraModel& left, const CameraModel& right,
                                const Transform<RightCamera, Camera>& right_from_left);

/// right_from_left, mm: a 4x4 matrix as text, or T_cn_cnm1 of a camera of Kalibr's camchain (camchain.yaml:cam1).
Result<Eigen::Matrix4d> read_camera_relation(const std::filesystem::path& path);

/// camera_covariance (9x9: fx fy cx cy in px, k1 k2 p1 p2 k3) of a camera file in OpenCV's YAML, as `calibrate camera`
/// writes it. Empty where the file holds none or is of another program; an error where it holds another matrix, or one
/// with a variance below zero.
Result<std::optional<CameraMatrix>> read_camera_covariance(const std::filesystem::path& path);
/// What to append to camera_text.
std::string camera_covariance_text(const CameraMatrix& covariance);

}  // namespace birdseye::host
