#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"

/// What the texts of camera files say (camera_files.hpp has which), parsed by OpenCV and yaml-cpp in this process.
/// Errors go on from the file's name. name: which of several cameras is meant, as "cam1"; empty where none is named.
namespace birdseye::host {

Result<CameraModel> parse_camera(const std::string& text, const std::string& name);

/// T_cn_cnm1 of a camera of Kalibr's camchain, row by row, its lengths in metres.
Result<std::array<double, 16>> parse_camera_relation(const std::string& text, const std::string& name);

/// camera_covariance, row by row.
struct StoredCovariance {
  std::uint8_t count = 0;  ///< of the matrices that are there: 0 or 1
  static constexpr std::size_t kNumbers = CameraModel::kParameters * std::size_t{CameraModel::kParameters};
  std::array<double, kNumbers> by_rows{};
};
Result<StoredCovariance> parse_camera_covariance(const std::string& text);

}  // namespace birdseye::host
