#pragma once

#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/solve/board.hpp"

namespace birdseye::calibration {

struct Intrinsics {
  CameraModel camera;
  double rms_px = 0;  ///< of all corners' reprojection errors
  std::vector<double> view_rms_px;
  std::vector<Transform<Camera, Marker>> camera_from_marker;  ///< one per view
};

/// How many of the distortion's terms are solved for; the rest stay 0.
enum class Distortion { radial2_tangential2, radial3_tangential2 };

/// Z. Zhang's method (2000) through OpenCV's calibrateCamera. points_mm: of the board, in the order of the views'
/// corners. Refuses fewer than three views (Errc::degenerate) and views whose corners do not match the points.
Result<Intrinsics> solve_intrinsics(std::span<const Eigen::Vector3d> points_mm, std::span<const BoardView> views,
                                    int width_px, int height_px,
                                    Distortion distortion = Distortion::radial2_tangential2);

}  // namespace birdseye::calibration
