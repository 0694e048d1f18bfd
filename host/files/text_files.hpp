#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// The matrix, or, with `where` before it, that it is no rigid transform: rotation to 1e-3, last row 0 0 0 1.
Result<Eigen::Matrix4d> check_rigid(const Eigen::Matrix4d& matrix, const std::string& where);
/// A rigid transform as a 4x4 matrix, four numbers a line, mm. Refuses a missing row, a last row that is not 0 0 0 1
/// and an upper left block that is no rotation (to 1e-3).
Result<Eigen::Matrix4d> read_pose(const std::filesystem::path& path);
/// The same of the text of that file, which was read already.
Result<Eigen::Matrix4d> parse_pose(const std::string& text, const std::filesystem::path& path);
/// Key poses of a camera's way, camera_from_patient, at least two: a folder of such matrices, in the order of their
/// names; or a file with one a line, its 16 numbers row by row. A first line of names is passed over, and so are a
/// number and a time before the 16: the simulator's frames.csv can be read.
Result<std::vector<Transform<Camera, Patient>>> read_path(const std::filesystem::path& path);
/// The text that read_pose reads back exactly.
std::string pose_text(const Eigen::Matrix4d& matrix);

}  // namespace birdseye::host
