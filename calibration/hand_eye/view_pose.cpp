#include "calibration/hand_eye/view_pose.hpp"

#include <fmt/format.h>

#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

/// Fewer leave the pose of a flat board open to one bad corner.
constexpr std::size_t kFewestCorners = 6;
/// Least over greatest extent of the corners on the board, below which they are a line.
constexpr double kLineRatio = 0.02;

/// Where a pinhole of focal length one would have seen them; empty unless the lens can show all.
std::optional<std::vector<cv::Point2d>> undistorted(const SeenCorners& corners) {
  std::vector<cv::Point2d> out;
  for (const Eigen::Vector2d& p : corners.view->points_px) {
    const auto ray = unproject(*corners.camera, p);
    if (!ray) return std::nullopt;
    out.emplace_back(ray->x(), ray->y());
  }
  return out;
}

struct Extent {
  double second_ratio, third_ratio;  ///< of the corners' spread along their principal axes, to the greatest
};

Extent extent_of(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : points) scatter += (p - mean) * (p - mean).transpose();
  const Eigen::Vector3d spread = symmetric_eigenvalues(scatter).cwiseMax(0).cwiseSqrt();
  return {spread[1] / spread[2], spread[0] / spread[2]};
}

std::vector<Transform<Camera, Marker>> starts_of(const SeenCorners& corners, bool flat) {
  const auto seen = undistorted(corners);
  if (!seen) return {};
  std::vector<cv::Point3d> points;
  for (const Eigen::Vector3d& p : corners.view->points_in_marker_mm) points.emplace_back(p.x(), p.y(), p.z());
  std::vector<cv::Mat> turns, shifts;
  std::vector<Transform<Camera, Marker>> out;
  try {
    cv::solvePnPGeneric(points, *seen, cv::Matx33d::eye(), cv::noArray(), turns, shifts, false,
                        flat ? cv::SOLVEPNP_IPPE : cv::SOLVEPNP_SQPNP);
  } catch (const cv::Exception&) {
    return {};
  }
  for (std::size_t i = 0; i < turns.size(); ++i) {
    Eigen::Vector3d turn, shift;
    cv::cv2eigen(turns[i], turn);
    cv::cv2eigen(shifts[i], shift);
    if (turn.allFinite() && shift.allFinite()) out.emplace_back(rotation_exp(turn), shift);
  }
  return out;
}

}  // namespace

std::optional<CornerSum> sum_corners(const std::vector<SeenCorners>& corners, const Transform<Camera, Marker>& pose,
                                     double sigma_px) {
  CornerSum out;
  const double bend_px = kCornerHuberSigmas * sigma_px;
  for (const SeenCorners& seen : corners) {
    const auto lens_from_marker = seen.lens_from_camera * pose;
    for (std::size_t i = 0; i < seen.view->points_px.size(); ++i) {
      const Eigen::Vector3d& point = seen.view->points_in_marker_mm[i];
      ProjectionJacobians jacobians;
      const auto pixel = project(*seen.camera, lens_from_marker * point, &jacobians);
      if (!pixel) return std::nullopt;
      Eigen::Matrix<double, 2, 6> by_pose;
      by_pose.rightCols<3>() = jacobians.by_point * seen.lens_from_camera.rotation();
      by_pose.leftCols<3>() = -by_pose.rightCols<3>() * cross_matrix(pose.rotation() * point);
      const Eigen::Vector2d error = *pixel - seen.view->points_px[i];
      const double size = error.norm();
      const double weight = size <= bend_px ? 1 : bend_px / size;
      out.information.noalias() += weight * by_pose.transpose() * by_pose;
      out.gradient.noalias() += weight * by_pose.transpose() * error;
      out.cost += size <= bend_px ? 0.5 * size * size : bend_px * (size - 0.5 * bend_px);
      out.squares += size * size;
      out.errors_px.push_back(size);
    }
  }
  return out;
}

Result<ViewPose> refine_view_pose(const std::vector<SeenCorners>& corners, const Transform<Camera, Marker>& start,
                                  double sigma_px) {
  Transform<Camera, Marker> pose = start;
  auto sum = sum_corners(corners, pose, sigma_px);
  if (!sum) return Error{Errc::degenerate, "the board comes out behind the camera: is it the right pattern?"};
  double damping = 1e-6;
  for (int i = 0; i < 60; ++i) {
    Matrix6d normal = sum->information;
    normal.diagonal() *= 1 + damping;
    const Vector6d step = -solve_symmetric(normal, sum->gradient);
    if (!step.allFinite()) return Error{Errc::degenerate, "its corners do not determine the board's pose"};
    const auto tried = moved(pose, step);
    const auto there = sum_corners(corners, tried, sigma_px);
    // At the bottom the cost changes by rounding alone; a step that is nothing against its own sigma ends it.
    const bool small = step.dot(sum->information * step) < 1e-18 * sigma_px * sigma_px;
    if (there && (there->cost <= sum->cost || small)) {
      pose = tried;
      sum = there;
      damping = std::max(damping * 0.1, 1e-15);
    } else {
      damping = std::max(damping * 10, 1e-6);
    }
    if (small || damping > 1e8) break;
  }
  return ViewPose{pose, sum->information, std::sqrt(sum->squares / static_cast<double>(sum->errors_px.size()))};
}

Result<ViewPose> find_view_pose(const std::vector<SeenCorners>& corners, double sigma_px) {
  const std::vector<Eigen::Vector3d>& points = corners.front().view->points_in_marker_mm;
  if (points.size() < kFewestCorners)
    return Error{Errc::degenerate, fmt::format("{} corners are seen, of at least {}", points.size(), kFewestCorners)};
  const Extent extent = extent_of(points);
  if (!(extent.second_ratio > kLineRatio)) return Error{Errc::degenerate, "its corners lie on one line"};
  const bool flat = extent.third_ratio < 1e-6;
  std::optional<ViewPose> best;
  for (const auto& start : starts_of(corners.front(), flat)) {
    const auto found = refine_view_pose(corners, start, sigma_px);
    if (found && (!best || found->rms_px < best->rms_px)) best = *found;
  }
  if (!best) return Error{Errc::degenerate, "its corners do not fit the board: are lens and pattern the right ones?"};
  return *best;
}

}  // namespace birdseye::calibration
