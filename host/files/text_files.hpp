#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// Points, three numbers a line, mm; lines that are blank or begin with # are passed over. A line of anything else is
/// an error that names file and line.
Result<std::vector<Eigen::Vector3d>> read_points(const std::filesystem::path& path);

/// A rigid transform as a 4x4 matrix, four numbers a line, mm. Refuses a missing row, a last row that is not 0 0 0 1
/// and an upper left block that is no rotation (to 1e-3).
Result<Eigen::Matrix4d> read_pose(const std::filesystem::path& path);
/// Key poses of a camera's way, camera_from_patient, at least two: a folder of such matrices, in the order of their
/// names; or a file with one a line, its 16 numbers row by row. A first line of names is passed over, and so are a
/// number and a time before the 16: the simulator's frames.csv can be read.
Result<std::vector<Transform<Camera, Patient>>> read_path(const std::filesystem::path& path);
/// The text that read_pose reads back exactly.
std::string pose_text(const Eigen::Matrix4d& matrix);

/// OpenCV YAML: image_width, image_height, camera_matrix (3x3), distortion_coefficients (4 or 5: k1 k2 p1 p2 [k3]).
Result<CameraModel> read_camera(const std::filesystem::path& path);
/// The text that read_camera reads back exactly.
std::string camera_text(const CameraModel& camera);

using CameraCovariance = Eigen::Matrix<double, CameraModel::kParameters, CameraModel::kParameters>;
/// From the same file: camera_covariance (9x9: fx fy cx cy in px, k1 k2 p1 p2 k3), as `calibrate camera` writes it.
/// Empty where the file holds none; an error where it holds another matrix or one with a variance below zero.
Result<std::optional<CameraCovariance>> read_camera_covariance(const std::filesystem::path& path);
/// What to append to camera_text.
std::string camera_covariance_text(const CameraCovariance& covariance);

}  // namespace birdseye::host
