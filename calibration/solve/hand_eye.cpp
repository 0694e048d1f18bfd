#include "calibration/solve/hand_eye.hpp"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "calibration/base/units.hpp"

namespace birdseye::calibration {

namespace {

/// Rotation vector, then translation: a pose as the solver moves it.
using Twist = std::array<double, 6>;

template <typename To, typename From>
Twist twist_of(const Transform<To, From>& t) {
  const Eigen::Vector3d r = rotation_log(t.rotation());
  return {r.x(), r.y(), r.z(), t.translation().x(), t.translation().y(), t.translation().z()};
}

template <typename To, typename From>
Transform<To, From> transform_of(const Twist& t) {
  return {rotation_exp(Eigen::Vector3d(t[0], t[1], t[2])), Eigen::Vector3d(t[3], t[4], t[5])};
}

/// One corner: marker -> tracker -> sensor (as measured, then corrected) -> camera, against where it was seen. Seen and
/// predicted meet in the undistorted plane, in pixels of the focal length.
struct CornerCost {
  Eigen::Vector3d point_in_marker_mm;
  Eigen::Vector2d seen;  ///< undistorted, normalised
  Transform<Sensor, Tracker> sensor_from_tracker;
  double fx_px, fy_px, sigma_px;

  template <typename T>
  bool operator()(const T* camera_from_sensor, const T* tracker_from_marker, const T* correction, T* residual) const {
    T p[3], q[3];
    const T marker[3] = {T(point_in_marker_mm.x()), T(point_in_marker_mm.y()), T(point_in_marker_mm.z())};
    ceres::AngleAxisRotatePoint(tracker_from_marker, marker, p);
    for (int i = 0; i < 3; ++i) p[i] += tracker_from_marker[3 + i];
    for (int i = 0; i < 3; ++i) {
      q[i] = T(sensor_from_tracker.translation()[i]);
      for (int j = 0; j < 3; ++j) q[i] += T(sensor_from_tracker.rotation()(i, j)) * p[j];
    }
    ceres::AngleAxisRotatePoint(correction, q, p);
    for (int i = 0; i < 3; ++i) p[i] += correction[3 + i];
    ceres::AngleAxisRotatePoint(camera_from_sensor, p, q);
    for (int i = 0; i < 3; ++i) q[i] += camera_from_sensor[3 + i];
    if (q[2] < T(1e-6)) return false;
    residual[0] = (q[0] / q[2] - T(seen.x())) * T(fx_px / sigma_px);
    residual[1] = (q[1] / q[2] - T(seen.y())) * T(fy_px / sigma_px);
    return true;
  }
};

/// How far the tracker may have been off.
struct CorrectionCost {
  double angle_sigma_rad, position_sigma_mm;
  template <typename T>
  bool operator()(const T* correction, T* residual) const {
    for (int i = 0; i < 3; ++i) residual[i] = correction[i] / T(angle_sigma_rad);
    for (int i = 3; i < 6; ++i) residual[i] = correction[i] / T(position_sigma_mm);
    return true;
  }
};

/// The turns from the first station to the others must span a plane of axes.
Result<void> check_turns(std::span<const Transform<Tracker, Sensor>> poses) {
  constexpr double kLeastTurn = 5 * kRadPerDeg;
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (const auto& pose : poses) {
    const Eigen::Vector3d turn = rotation_log(poses[0].rotation().transpose() * pose.rotation());
    scatter += turn * turn.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scatter, Eigen::EigenvaluesOnly);
  if (std::sqrt(std::max(0.0, solver.eigenvalues()[1])) < kLeastTurn) {
    return Error{Errc::degenerate,
                 "the scope turned about one axis only, which leaves hand-eye open: tilt it about another"};
  }
  return {};
}

Transform<Camera, Sensor> closed_form(std::span<const Transform<Tracker, Sensor>> tracker_from_sensor,
                                      std::span<const Transform<Camera, Marker>> camera_from_marker) {
  std::vector<cv::Mat> r_gripper, t_gripper, r_target, t_target;
  const auto add = [](const Eigen::Matrix3d& r, const Eigen::Vector3d& t, std::vector<cv::Mat>& rs,
                      std::vector<cv::Mat>& ts) {
    cv::eigen2cv(r, rs.emplace_back());
    cv::eigen2cv(t, ts.emplace_back());
  };
  for (std::size_t i = 0; i < tracker_from_sensor.size(); ++i) {
    add(tracker_from_sensor[i].rotation(), tracker_from_sensor[i].translation(), r_gripper, t_gripper);
    add(camera_from_marker[i].rotation(), camera_from_marker[i].translation(), r_target, t_target);
  }
  cv::Mat r, t;
  cv::calibrateHandEye(r_gripper, t_gripper, r_target, t_target, r, t, cv::CALIB_HAND_EYE_PARK);
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  cv::cv2eigen(r, rotation);
  cv::cv2eigen(t, translation);
  return Transform<Sensor, Camera>(rotation, translation).inverse();
}

}  // namespace

Result<HandEye> solve_hand_eye(std::span<const Eigen::Vector3d> points_mm, std::span<const BoardView> views,
                               std::span<const Transform<Tracker, Sensor>> tracker_from_sensor,
                               std::span<const Transform<Camera, Marker>> camera_from_marker, const CameraModel& camera,
                               const HandEyeSettings& settings) {
  const std::size_t stations = views.size();
  if (stations < 3 || tracker_from_sensor.size() != stations || camera_from_marker.size() != stations) {
    return Error{Errc::degenerate,
                 fmt::format("{} stations with board and pose: hand-eye needs at least three", stations)};
  }
  for (const BoardView& view : views) {
    if (points_mm.empty() || view.corners_px.size() != points_mm.size()) {
      return Error{Errc::bad_value,
                   fmt::format("a view of {} corners for a board of {}", view.corners_px.size(), points_mm.size())};
    }
  }
  if (auto turns = check_turns(tracker_from_sensor); !turns) return turns.error();
  Transform<Camera, Sensor> start;
  try {
    start = closed_form(tracker_from_sensor, camera_from_marker);
  } catch (const cv::Exception&) {
    return Error{Errc::degenerate, "the stations do not determine hand-eye: take more, with larger turns"};
  }
  Twist hand_eye = twist_of(start);
  Twist marker = twist_of(tracker_from_sensor[0] * start.inverse() * camera_from_marker[0]);
  std::vector<Twist> corrections(stations, Twist{});

  ceres::Problem problem;
  for (std::size_t i = 0; i < stations; ++i) {
    for (std::size_t k = 0; k < points_mm.size(); ++k) {
      const auto seen = unproject(camera, views[i].corners_px[k]);
      if (!seen) continue;
      auto* cost = new CornerCost{points_mm[k], seen->head<2>(), tracker_from_sensor[i].inverse(),
                                  camera.fx_px, camera.fy_px,    settings.corner_sigma_px};
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CornerCost, 2, 6, 6, 6>(cost), new ceres::HuberLoss(4.0),
                               hand_eye.data(), marker.data(), corrections[i].data());
    }
    auto* prior = new CorrectionCost{settings.angle_sigma_rad, settings.position_sigma_mm};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<CorrectionCost, 6, 6>(prior), nullptr,
                             corrections[i].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) {
    return Error{Errc::degenerate, "hand-eye does not converge: are the poses and pictures of the same moments?"};
  }

  HandEye out;
  out.camera_from_sensor = transform_of<Camera, Sensor>(hand_eye);
  out.tracker_from_marker = transform_of<Tracker, Marker>(marker);
  double all = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < stations; ++i) {
    const auto camera_from_board = out.camera_from_sensor * tracker_from_sensor[i].inverse() * out.tracker_from_marker;
    double squares = 0;
    for (std::size_t k = 0; k < points_mm.size(); ++k) {
      const auto seen = project(camera, camera_from_board * points_mm[k]);
      if (!seen)
        return Error{Errc::degenerate,
                     "hand-eye puts the board behind the camera: are poses and pictures of the same moments?"};
      squares += (*seen - views[i].corners_px[k]).squaredNorm();
    }
    out.view_tracked_rms_px.push_back(std::sqrt(squares / static_cast<double>(points_mm.size())));
    all += squares;
    count += points_mm.size();
  }
  out.tracked_rms_px = std::sqrt(all / static_cast<double>(count));
  return out;
}

}  // namespace birdseye::calibration
