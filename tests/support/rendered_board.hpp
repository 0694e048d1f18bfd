#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "calibration/detect/pattern.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::testing {

/// How a picture of a board is spoilt, in grey levels and px.
struct Shot {
  double dark = 40, light = 200;
  double noise = 2;       ///< standard deviation
  double blur_px = 1;     ///< standard deviation
  double motion_px = 0;   ///< length of the line along which the picture moved ..
  double motion_deg = 0;  ///< .. and where to, from x towards y
  double glare_radius_px = 0;
  Eigen::Vector2d glare_px{0, 0};
  unsigned seed = 1;
};

/// Pictures of a flat board, drawn from its description alone: every pixel is the mean of 16 places of the board that
/// are worked out in double precision, then blurred, lit unevenly, made noisy and rounded.
class BoardPainter {
 public:
  explicit BoardPainter(const CameraModel& camera);

  [[nodiscard]] cv::Mat paint(const calibration::Pattern& pattern, const Transform<Camera, Marker>& camera_from_marker,
                              const Shot& shot = {}) const;

 private:
  CameraModel camera_;
  std::vector<Eigen::Vector3d> rays_;  ///< of the pixels' corners
};

/// 0 (dark) to 1 (light) at a place of the board's plane, mm; beyond the sheet something grey.
class BoardArt {
 public:
  explicit BoardArt(const calibration::Pattern& pattern);
  [[nodiscard]] double at(double x_mm, double y_mm) const;

 private:
  [[nodiscard]] double chessboard(double x, double y) const;
  [[nodiscard]] double charuco(double x, double y) const;
  /// Of the chessboard in the middle, its first square light, and of the white about it; less than 0 beyond.
  [[nodiscard]] double inset(double x_mm, double y_mm) const;

  calibration::Pattern pattern_;
  std::vector<cv::Mat> tags_;       ///< a pixel for each of a tag's modules, its black border among them
  std::vector<int> tag_of_square_;  ///< row by row, -1: black
};

/// The board's middle at a place before the camera, tilted about an axis in the picture's plane, then turned in it.
Transform<Camera, Marker> held(const calibration::Pattern& pattern, const Eigen::Vector3d& middle_in_camera_mm,
                               double tilt_deg, double tilt_axis_deg, double turn_deg);

/// A wide lens of the laparoscope's kind.
CameraModel barrel_camera();
/// Pictures as it takes them.
const BoardPainter& barrel_painter();

}  // namespace birdseye::testing
