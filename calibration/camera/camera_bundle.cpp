#include "calibration/camera/camera_bundle.hpp"

#include <ceres/cost_function.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "calibration/camera/bundle_solver.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

using RowMajor9 = Eigen::Matrix<double, 2, CameraModel::kParameters, Eigen::RowMajor>;
using RowMajor6 = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>;

/// All points of one view by the lens (9) and the pose (turn from where it started, then translation).
class ViewCost final : public ceres::CostFunction {
 public:
  ViewCost(const CameraModel& camera, const BundleView& view)
      : camera_(camera), view_(view), start_(view.camera_from_marker.rotation()) {
    for (std::size_t i = 0; i < view.weights.size(); ++i) {
      if (view.weights[i] > 0) used_.push_back(i);
    }
    set_num_residuals(static_cast<int>(2 * used_.size()));
    mutable_parameter_block_sizes()->assign({CameraModel::kParameters, 6});
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    CameraModel camera = camera_;
    set_parameters(camera, parameters[0]);
    if (!likely(camera)) return false;
    const Eigen::Map<const Eigen::Vector3d> turn(parameters[1]), shift_mm(parameters[1] + 3);
    const Eigen::Matrix3d rotation = rotation_exp(turn) * start_;
    const Eigen::Matrix3d by_turn = left_jacobian(turn);
    double* by_lens = jacobians != nullptr ? jacobians[0] : nullptr;
    double* by_pose = jacobians != nullptr ? jacobians[1] : nullptr;
    ProjectionJacobians by;
    for (std::size_t k = 0; k < used_.size(); ++k) {
      const std::size_t i = used_[k];
      const Eigen::Vector3d turned = rotation * view_.points_mm[i];
      const auto pixel = project(camera, turned + shift_mm, jacobians != nullptr ? &by : nullptr);
      if (!pixel || !pixel->allFinite()) return false;
      const double root = std::sqrt(view_.weights[i]);
      Eigen::Map<Eigen::Vector2d>(residuals + 2 * k) = root * (*pixel - view_.points_px[i]);
      if (by_lens != nullptr)
        Eigen::Map<RowMajor9>(by_lens + std::size_t{2} * CameraModel::kParameters * k) = root * by.by_parameter;
      if (by_pose == nullptr) continue;
      Eigen::Matrix<double, 2, 6> d = pixel_by_pose(by.by_point, turned);
      d.leftCols<3>() *= by_turn;
      Eigen::Map<RowMajor6>(by_pose + 12 * k) = root * d;
    }
    return true;
  }

 private:
  /// Views that leave the focal length open would let it run to infinity and its board with it.
  static bool likely(const CameraModel& c) {
    constexpr double kLongest = 100;  // of the width: a field of half a degree
    const auto sound = [&](double focal_px) { return focal_px > 0 && focal_px < kLongest * c.width_px; };
    return sound(c.fx_px) && sound(c.fy_px);
  }

  const CameraModel& camera_;
  const BundleView& view_;
  Eigen::Matrix3d start_;
  std::vector<std::size_t> used_;
};

double weight_of(std::span<const BundleView> views) {
  double sum = 0;
  for (const BundleView& view : views) {
    for (const double w : view.weights) sum += w;
  }
  return sum;
}

bool any_used(const BundleView& view) {
  return std::any_of(view.weights.begin(), view.weights.end(), [](double w) { return w > 0; });
}

}  // namespace

Eigen::Matrix<double, 2, 6> pixel_by_pose(const Eigen::Matrix<double, 2, 3>& pixel_by_point,
                                          const Eigen::Vector3d& turned_point_mm) {
  Eigen::Matrix<double, 2, 6> out;
  out << -pixel_by_point * cross_matrix(turned_point_mm), pixel_by_point;
  return out;
}

BundleSummary refine_bundle(CameraModel& camera, std::span<BundleView> views,
                            const std::array<bool, CameraModel::kParameters>& solved, const BundleSettings& settings) {
  ceres::Problem problem;
  CameraVector lens = parameters_of(camera);
  std::vector<std::array<double, 6>> poses(views.size());
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Eigen::Vector3d& t = views[v].camera_from_marker.translation();
    poses[v] = {0, 0, 0, t.x(), t.y(), t.z()};
    if (!any_used(views[v])) continue;
    problem.AddResidualBlock(new ViewCost(camera, views[v]), nullptr, lens.data(), poses[v].data());
    ordering->AddElementToGroup(poses[v].data(), 0);
  }
  ordering->AddElementToGroup(lens.data(), 1);
  hold_unsolved(problem, lens.data(), solved);
  const ceres::Solver::Summary solved_as = solve_bundle(problem, ordering, settings);

  BundleSummary summary;
  summary.converged = solved_as.termination_type == ceres::CONVERGENCE;
  const double weight = weight_of(views);
  for (const auto& step : solved_as.iterations) summary.rms_px.push_back(std::sqrt(2 * step.cost / weight));
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Eigen::Map<const Eigen::Vector3d> turn(poses[v].data()), shift_mm(poses[v].data() + 3);
    const Eigen::Matrix3d rotation = rotation_exp(turn) * views[v].camera_from_marker.rotation();
    // Through a quaternion, so that rounding does not pile up over many refinements.
    views[v].camera_from_marker = Transform<Camera, Marker>(Eigen::Quaterniond(rotation), shift_mm);
  }
  set_parameters(camera, lens.data());
  return summary;
}

std::vector<Eigen::Vector2d> residuals_px(const CameraModel& camera, const BundleView& view) {
  std::vector<Eigen::Vector2d> out;
  out.reserve(view.points_mm.size());
  for (std::size_t i = 0; i < view.points_mm.size(); ++i) {
    const auto pixel = project(camera, view.camera_from_marker * view.points_mm[i]);
    out.emplace_back(pixel ? Eigen::Vector2d(view.points_px[i] - *pixel)
                           : Eigen::Vector2d(camera.width_px, camera.height_px));
  }
  return out;
}

namespace {

struct PoseNormal {
  Matrix6d matrix = Matrix6d::Zero();
  Vector6d vector = Vector6d::Zero();
  double cost = 0;
};

PoseNormal normal_of(const CameraModel& camera, const BundleView& view, const Transform<Camera, Marker>& pose) {
  PoseNormal out;
  ProjectionJacobians by;
  for (std::size_t i = 0; i < view.points_mm.size(); ++i) {
    if (!(view.weights[i] > 0)) continue;
    const Eigen::Vector3d turned = pose.rotation() * view.points_mm[i];
    const auto pixel = project(camera, turned + pose.translation(), &by);
    if (!pixel) {
      out.cost = HUGE_VAL;
      return out;
    }
    const Eigen::Vector2d residual = view.points_px[i] - *pixel;
    const Eigen::Matrix<double, 2, 6> d = pixel_by_pose(by.by_point, turned);
    out.matrix.noalias() += view.weights[i] * d.transpose() * d;
    out.vector.noalias() += view.weights[i] * d.transpose() * residual;
    out.cost += view.weights[i] * residual.squaredNorm();
  }
  return out;
}

}  // namespace

Transform<Camera, Marker> fit_pose(const CameraModel& camera, const BundleView& view) {
  constexpr int kMostSteps = 30;
  constexpr double kEnough = 1e-12;
  Transform<Camera, Marker> at = view.camera_from_marker;
  PoseNormal normal = normal_of(camera, view, at);
  double damping = 1e-6;
  for (int step = 0; step < kMostSteps && damping < 1e6; ++step) {
    Matrix6d damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    const Vector6d move = solve_symmetric(damped, normal.vector);
    const Transform<Camera, Marker> next(Eigen::Matrix3d(rotation_exp(Eigen::Vector3d(move.head<3>())) * at.rotation()),
                                         Eigen::Vector3d(at.translation() + move.tail<3>()));
    const PoseNormal there = normal_of(camera, view, next);
    if (!(there.cost <= normal.cost)) {
      damping *= 10;
      continue;
    }
    const double gain = normal.cost - there.cost;
    at = next;
    normal = there;
    damping *= 0.1;
    if (gain <= kEnough * normal.cost) break;
  }
  return at;
}

CameraMatrix lens_information(const CameraModel& camera, std::span<const BundleView> views) {
  CameraMatrix information = CameraMatrix::Zero();
  ProjectionJacobians by;
  for (const BundleView& view : views) {
    Eigen::Matrix<double, 9, 6> cross = Eigen::Matrix<double, 9, 6>::Zero();
    Matrix6d of_pose = Matrix6d::Zero();
    for (std::size_t i = 0; i < view.points_mm.size(); ++i) {
      const Eigen::Vector3d turned = view.camera_from_marker.rotation() * view.points_mm[i];
      if (!(view.weights[i] > 0) || !project(camera, turned + view.camera_from_marker.translation(), &by)) continue;
      const Eigen::Matrix<double, 2, 6> d = pixel_by_pose(by.by_point, turned);
      information.noalias() += view.weights[i] * by.by_parameter.transpose() * by.by_parameter;
      cross.noalias() += view.weights[i] * by.by_parameter.transpose() * d;
      of_pose.noalias() += view.weights[i] * d.transpose() * d;
    }
    if (any_used(view)) information -= cross * solve_symmetric(of_pose, Matrix6Xd(cross.transpose()));
  }
  return information;
}

}  // namespace birdseye::calibration
