#pragma once

#include <filesystem>
#include <opencv2/core.hpp>

#include "calibration/geometry/camera_model.hpp"

namespace birdseye::testing {

/// A lens as `--camera` takes it, in the form of OpenCV's own files.
inline void write_lens(const std::filesystem::path& path, const CameraModel& lens) {
  cv::FileStorage file(path.string(), cv::FileStorage::WRITE | cv::FileStorage::FORMAT_YAML);
  file << "image_width" << lens.width_px << "image_height" << lens.height_px;
  file << "camera_matrix" << (cv::Mat_<double>(3, 3) << lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1);
  file << "distortion_coefficients" << (cv::Mat_<double>(1, 5) << lens.k1, lens.k2, lens.p1, lens.p2, lens.k3);
}

}  // namespace birdseye::testing
