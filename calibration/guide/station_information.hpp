#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// What one station's pose and one corner are uncertain by, one standard deviation per axis.
struct StationNoise {
  // A miniBIRD's 1.8 mm and 0.5 degrees RMS, over three axes.
  double position_sigma_mm = 1.04, angle_sigma_rad = 0.29 * kRadPerDeg;
  double corner_sigma_px = 0.3;
};

/// What stations teach of the two unknowns of hand-eye, the camera on its sensor X = camera_from_sensor and the board
/// W = tracker_from_marker, linearised. A station with the sensor at S sees the board at C = X S^-1 W. With
/// X -> exp(x) X, W -> W exp(w), the tracker's error S -> S exp(s) and the corners' error exp(c),
///
///   C -> exp(x + Ad_C w - Ad_X s + c) C,
///
/// each a rotation (rad) before a translation (mm): a measurement of [I, Ad_C] (x, w) with the covariance
/// Ad_X cov(s) Ad_X^T + cov(c), where cov(c) is that of a pose fitted to the corners.
class StationInformation {
 public:
  using Matrix12 = Eigen::Matrix<double, 12, 12>;

  /// board_points_mm: in the frame Marker, about where the corners are; only those in the picture count. working_mm:
  /// the distance at which an error of rotation is turned into mm.
  StationInformation(const CameraModel& camera, std::vector<Eigen::Vector3d> board_points_mm,
                     const Transform<Camera, Sensor>& camera_from_sensor, double working_mm, const StationNoise& noise);

  void add(const Transform<Camera, Marker>& camera_from_marker);
  /// Must be called after the last add and before the questions below.
  void solve();

  /// The expected error of the hand-eye: the root of the sum of its variances, rotations times the working distance.
  [[nodiscard]] double expected_error_mm() const;
  /// The same with one more station.
  [[nodiscard]] double expected_error_mm(const Transform<Camera, Marker>& one_more) const;

 private:
  [[nodiscard]] Matrix6d covariance_of(const Transform<Camera, Marker>& camera_from_marker) const;

  CameraModel camera_;
  std::vector<Eigen::Vector3d> board_points_mm_;
  Matrix6d tracker_covariance_;  ///< in the camera frame
  double corner_weight_;
  Eigen::Matrix<double, 6, 1> scale_;  ///< of the hand-eye's components to mm
  Matrix12 information_, covariance_;
};

/// The hand-eye that motions between stations suggest: the rotation that brings the axes of the sensor's motions to
/// those of the camera's (after F. Park and B. Martin, 1994), least squares for the translation. Good enough for
/// weighing only: what the stations leave open is set to zero.
Transform<Camera, Sensor> rough_hand_eye(std::span<const Transform<Tracker, Sensor>> tracker_from_sensor,
                                         std::span<const Transform<Camera, Marker>> camera_from_marker);

}  // namespace birdseye::calibration
