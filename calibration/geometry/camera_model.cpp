#include "calibration/geometry/camera_model.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cmath>

namespace birdseye {

Result<void> check(const CameraModel& c) {
  if (c.width_px <= 0 || c.height_px <= 0) {
    return Error{Errc::bad_value, fmt::format("camera: image size {}x{} is not positive", c.width_px, c.height_px)};
  }
  constexpr int kLargestSide = 16384;
  if (c.width_px > kLargestSide || c.height_px > kLargestSide) {
    return Error{Errc::bad_value,
                 fmt::format("camera: image size {}x{} is over {} a side", c.width_px, c.height_px, kLargestSide)};
  }
  if (!(c.fx_px > 0) || !(c.fy_px > 0)) {
    return Error{Errc::bad_value, fmt::format("camera: focal lengths {}, {} px must be positive", c.fx_px, c.fy_px)};
  }
  for (const double v : {c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.k3}) {
    if (!std::isfinite(v)) return Error{Errc::bad_value, "camera: a parameter is not a finite number"};
  }
  // Far beyond any lens single precision ends, in which pictures are drawn.
  constexpr double kMost = 1e6;
  for (const double v : {c.fx_px, c.fy_px, 1 / c.fx_px, 1 / c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2, c.k3}) {
    if (std::abs(v) > kMost)
      return Error{Errc::bad_value,
                   "camera: a parameter is beyond that of any lens (a millionth or a million); "
                   "calibrate again"};
  }
  // Pixels are at most eight times as tall as wide, or as wide as tall (--pixel-aspect).
  constexpr double kMostUnlike = 10;
  if (c.fx_px > kMostUnlike * c.fy_px || c.fy_px > kMostUnlike * c.fx_px) {
    return Error{Errc::bad_value, fmt::format("camera: focal lengths {}, {} px are more than {:g} times apart; mend "
                                              "them, or calibrate again",
                                              c.fx_px, c.fy_px, kMostUnlike)};
  }
  const auto is_far_outside = [](double px, int size_px) { return px < -0.5 * size_px || px > 1.5 * size_px; };
  if (is_far_outside(c.cx_px, c.width_px) || is_far_outside(c.cy_px, c.height_px)) {
    return Error{Errc::bad_value, fmt::format("camera: its centre {}, {} px is far outside its picture of {}x{} px; "
                                              "mend them, or calibrate again",
                                              c.cx_px, c.cy_px, c.width_px, c.height_px)};
  }
  return {};
}

Eigen::Vector2d distort(const CameraModel& c, const Eigen::Vector2d& undistorted, Eigen::Matrix2d* jacobian) {
  const double x = undistorted.x();
  const double y = undistorted.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (c.k1 + r2 * (c.k2 + r2 * c.k3));
  if (jacobian != nullptr) {
    const double radial_by_r2 = c.k1 + r2 * (2 * c.k2 + r2 * 3 * c.k3);
    const double cross = 2 * x * y * radial_by_r2 + 2 * c.p1 * x + 2 * c.p2 * y;
    *jacobian << radial + 2 * x * x * radial_by_r2 + 2 * c.p1 * y + 6 * c.p2 * x, cross,  //
        cross, radial + 2 * y * y * radial_by_r2 + 6 * c.p1 * y + 2 * c.p2 * x;
  }
  return {x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x),
          y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y};
}

std::optional<Eigen::Vector2d> undistort(const CameraModel& c, const Eigen::Vector2d& distorted) {
  // Walk out from the axis along the distorted ray in steps: each Newton solve starts where the last one ended, so the
  // iterate stays on the branch that contains the axis, and a fold shows as a determinant that stops being positive.
  constexpr int kSteps = 8;
  constexpr int kIterations = 12;
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
  Eigen::Matrix2d jacobian;
  for (int step = 1; step <= kSteps; ++step) {
    const Eigen::Vector2d target = distorted * (static_cast<double>(step) / kSteps);
    double residual = 0;
    for (int i = 0; i < kIterations; ++i) {
      const Eigen::Vector2d error = distort(c, x, &jacobian) - target;
      residual = error.norm();
      if (!(jacobian.determinant() > 1e-6)) return std::nullopt;
      if (residual < 1e-14) break;
      x -= jacobian.inverse() * error;
    }
    if (!(residual < 1e-10)) return std::nullopt;
  }
  return x;
}

std::optional<Eigen::Vector2d> project(const CameraModel& c, const Eigen::Vector3d& p, ProjectionJacobians* jacobians) {
  if (!(p.z() > 0)) return std::nullopt;
  const Eigen::Vector2d n(p.x() / p.z(), p.y() / p.z());
  Eigen::Matrix2d by_normalised;
  const Eigen::Vector2d d = distort(c, n, jacobians != nullptr ? &by_normalised : nullptr);
  if (jacobians != nullptr) {
    Eigen::Matrix<double, 2, 3> normalised_by_point;
    normalised_by_point << 1 / p.z(), 0, -n.x() / p.z(),  //
        0, 1 / p.z(), -n.y() / p.z();
    const Eigen::Vector2d focal(c.fx_px, c.fy_px);
    jacobians->by_point = focal.asDiagonal() * by_normalised * normalised_by_point;
    const double r2 = n.squaredNorm();
    const double r4 = r2 * r2;
    const double xy2 = 2 * n.x() * n.y();
    jacobians->by_parameter.row(0) << d.x(), 0, 1, 0, c.fx_px * n.x() * r2, c.fx_px * n.x() * r4, c.fx_px * xy2,
        c.fx_px * (r2 + 2 * n.x() * n.x()), c.fx_px * n.x() * r4 * r2;
    jacobians->by_parameter.row(1) << 0, d.y(), 0, 1, c.fy_px * n.y() * r2, c.fy_px * n.y() * r4,
        c.fy_px * (r2 + 2 * n.y() * n.y()), c.fy_px * xy2, c.fy_px * n.y() * r4 * r2;
  }
  return Eigen::Vector2d(c.fx_px * d.x() + c.cx_px, c.fy_px * d.y() + c.cy_px);
}

std::optional<Eigen::Vector3d> unproject(const CameraModel& c, const Eigen::Vector2d& pixel,
                                         Eigen::Matrix2d* jacobian) {
  const Eigen::Vector2d distorted((pixel.x() - c.cx_px) / c.fx_px, (pixel.y() - c.cy_px) / c.fy_px);
  const std::optional<Eigen::Vector2d> n = undistort(c, distorted);
  if (!n) return std::nullopt;
  if (jacobian != nullptr) {
    Eigen::Matrix2d by_undistorted;
    distort(c, *n, &by_undistorted);
    *jacobian = by_undistorted.inverse() * Eigen::Vector2d(1 / c.fx_px, 1 / c.fy_px).asDiagonal();
  }
  return Eigen::Vector3d(n->x(), n->y(), 1);
}

}  // namespace birdseye
