#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/case/bezier_map.hpp"
#include "hw-sim/case/landmarks.hpp"
#include "hw-sim/case/tissue_map.hpp"

namespace birdseye::hw_sim {

/// OpenCV YAML with the keys that calibration programs write.
Result<void> write_camera(const std::filesystem::path& path, const CameraModel& camera);
/// A 4x4 matrix, four numbers a line, mm.
Result<void> write_pose(const std::filesystem::path& path, const Transform<Camera, Patient>& camera_from_patient);
/// PNG of one channel, or of three in RGB order.
Result<void> write_picture(const std::filesystem::path& path, std::span<const std::uint8_t> pixels,
                           const CameraModel& camera);
/// name, rest and deformed, patient LPS mm.
Result<void> write_landmarks(const std::filesystem::path& path, const std::vector<TrueLandmark>& landmarks);
/// x y z and the one sigma, patient LPS mm.
Result<void> write_surface_points(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points_mm,
                                  double sigma_mm);
/// The map as an ITK displacement field on a lattice that spans its box.
Result<void> write_map_field(const std::filesystem::path& path, const TissueMap& map);
/// The map itself, as JSON.
Result<void> write_control_points(const std::filesystem::path& path, const BezierMap& map);

}  // namespace birdseye::hw_sim
