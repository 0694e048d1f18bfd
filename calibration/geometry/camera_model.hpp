#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration/base/result.hpp"

namespace birdseye {

/// Pinhole with Brown-Conrady distortion, in OpenCV's convention: pixel centres at integers, x right, y down, z
/// forward.
///
///   x = X/Z, y = Y/Z, r2 = x^2 + y^2, radial = 1 + k1 r2 + k2 r2^2 + k3 r2^3
///   x_d = x radial + 2 p1 x y + p2 (r2 + 2 x^2)
///   y_d = y radial + p1 (r2 + 2 y^2) + 2 p2 x y
///   u = fx x_d + cx, v = fy y_d + cy
///
/// Source: D. C. Brown, "Close-range camera calibration", 1971, as OpenCV orders the coefficients.
struct CameraModel {
  int width_px = 0, height_px = 0;
  double fx_px = 0, fy_px = 0, cx_px = 0, cy_px = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  bool operator==(const CameraModel&) const = default;

  /// Number of parameters in the Jacobians below: fx fy cx cy k1 k2 p1 p2 k3, in that order.
  static constexpr int kParameters = 9;
};

/// Refuses sizes or focal lengths that are not positive, numbers that are not finite, focal lengths too far apart for
/// any pixels, and a centre (cx, cy) more than half a picture outside the picture.
Result<void> check(const CameraModel& camera);

/// Normalised, undistorted (x, y) -> normalised, distorted. jacobian: 2x2, d(distorted)/d(x, y).
Eigen::Vector2d distort(const CameraModel& camera, const Eigen::Vector2d& undistorted,
                        Eigen::Matrix2d* jacobian = nullptr);

/// Normalised, distorted -> undistorted, by Newton's method. Empty where the lens folds (no preimage on the branch that
/// contains the optical axis), so a caller never gets a ray that does not project back.
std::optional<Eigen::Vector2d> undistort(const CameraModel& camera, const Eigen::Vector2d& distorted);

struct ProjectionJacobians {
  Eigen::Matrix<double, 2, 3> by_point;                             ///< px per mm
  Eigen::Matrix<double, 2, CameraModel::kParameters> by_parameter;  ///< px per unit of each parameter
};

/// Point in the camera frame, mm -> pixel. Empty at or behind the camera (Z <= 0).
std::optional<Eigen::Vector2d> project(const CameraModel& camera, const Eigen::Vector3d& point_in_camera_mm,
                                       ProjectionJacobians* jacobians = nullptr);

/// Pixel -> direction of unit Z (x, y, 1) in the camera frame; jacobian: 2x2, d(x, y)/d(u, v). Empty as undistort is.
std::optional<Eigen::Vector3d> unproject(const CameraModel& camera, const Eigen::Vector2d& pixel,
                                         Eigen::Matrix2d* jacobian = nullptr);

}  // namespace birdseye
