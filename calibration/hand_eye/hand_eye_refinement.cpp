#include "calibration/hand_eye/hand_eye_refinement.hpp"

#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/ordered_groups.h>
#include <ceres/problem.h>
#include <ceres/product_manifold.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include <array>
#include <memory>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

/// A pose as Ceres moves it: quaternion (x, y, z, w), translation.
using PoseBlock = std::array<double, 7>;
using PoseManifold = ceres::ProductManifold<ceres::EigenQuaternionManifold, ceres::EuclideanManifold<3>>;
template <int kRows>
using BlockJacobian = Eigen::Matrix<double, kRows, 7, Eigen::RowMajor>;

template <typename To, typename From>
PoseBlock block_of(const Transform<To, From>& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  const Eigen::Vector3d& t = pose.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

template <typename To, typename From>
Transform<To, From> pose_of(const double* block) {
  return {Eigen::Quaterniond(block[3], block[0], block[1], block[2]), Eigen::Vector3d(block[4], block[5], block[6])};
}

/// A Jacobian by (rotation vector, translation) as one by the seven numbers, such that Ceres, which multiplies it by
/// how these move with its local step, gets the first back. Its step is half the rotation vector, and the numbers'
/// motion by it has orthonormal columns, so that the transpose is the inverse.
template <int kRows>
BlockJacobian<kRows> by_numbers(const Eigen::Matrix<double, kRows, 6>& by_pose, const double* block) {
  const Eigen::Vector3d v(block[0], block[1], block[2]);
  Eigen::Matrix<double, 4, 3> motion;
  motion << block[3] * Eigen::Matrix3d::Identity() - cross_matrix(v), -v.transpose();
  BlockJacobian<kRows> out;
  out << 2 * by_pose.template leftCols<3>() * motion.transpose(), by_pose.template rightCols<3>();
  return out;
}

/// One corner, by the board's pose in the camera.
class CornerCost : public ceres::SizedCostFunction<2, 7> {
 public:
  CornerCost(const SeenCorners& corners, std::size_t which, double sigma_px)
      : corners_(corners), which_(which), sigma_px_(sigma_px) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const auto pose = pose_of<Camera, Marker>(parameters[0]);
    const Eigen::Vector3d& point = corners_.view->points_in_marker_mm[which_];
    ProjectionJacobians by;
    const auto pixel = project(*corners_.camera, corners_.lens_from_camera * (pose * point), &by);
    if (!pixel) return false;
    Eigen::Map<Eigen::Vector2d> off(residuals);
    off = (*pixel - corners_.view->points_px[which_]) / sigma_px_;
    if (jacobians == nullptr || jacobians[0] == nullptr) return true;
    Eigen::Matrix<double, 2, 6> by_pose;
    by_pose.rightCols<3>() = by.by_point * corners_.lens_from_camera.rotation() / sigma_px_;
    by_pose.leftCols<3>() = -by_pose.rightCols<3>() * cross_matrix(pose.rotation() * point);
    Eigen::Map<BlockJacobian<2>> out(jacobians[0]);
    out = by_numbers<2>(by_pose, parameters[0]);
    return true;
  }

 private:
  SeenCorners corners_;
  std::size_t which_;
  double sigma_px_;
};

/// One tracked pose, by the board's pose in the camera, hand-eye, body_from_marker and the time offset.
class TrackedCost : public ceres::SizedCostFunction<6, 7, 7, 7, 1> {
 public:
  TrackedCost(const TrackedChain& chain, const TrackerNoise& noise)
      : chain_(chain), whiten_(whitening(chain_covariance(chain, noise))) {}

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    ChainState state;
    state.camera_from_sensor = pose_of<Camera, Sensor>(parameters[1]);
    state.body_from_marker = pose_of<TrackedBody, Marker>(parameters[2]);
    state.time_offset_s = parameters[3][0];
    const ChainResidual r = chain_residual(chain_, pose_of<Camera, Marker>(parameters[0]), state);
    Eigen::Map<Vector6d> off(residuals);
    off = whiten_ * r.value;
    if (jacobians == nullptr) return true;
    const std::array<const Matrix6d*, 3> by{&r.by_camera_from_marker, &r.by_hand_eye, &r.by_body_from_marker};
    for (std::size_t i = 0; i < by.size(); ++i) {
      if (jacobians[i] == nullptr) continue;
      Eigen::Map<BlockJacobian<6>> out(jacobians[i]);
      out = by_numbers<6>(whiten_ * *by.at(i), parameters[i]);
    }
    if (jacobians[3] == nullptr) return true;
    Eigen::Map<Vector6d> by_time(jacobians[3]);
    by_time = whiten_ * r.by_time_offset;
    return true;
  }

 private:
  TrackedChain chain_;
  Matrix6d whiten_;
};

/// The normal equations of one station, by the board's pose in the camera (c) and by what all stations share (a).
struct StationNormal {
  Matrix6d cc;
  Eigen::MatrixXd ac, aa;
  Vector6d c;
  Eigen::VectorXd a;
};

std::optional<StationNormal> normal_of(const CornerStation& station, const Transform<Camera, Marker>& view,
                                       const ChainState& state, const TrackerNoise& noise, double sigma_px,
                                       const ChainFreedom& freedom) {
  const auto corners = sum_corners(station.corners, view, sigma_px);
  if (!corners) return std::nullopt;
  const ChainResidual r = chain_residual(station.chain, view, state);
  Eigen::MatrixXd by_shared(6, freedom.parameters());
  by_shared.leftCols<12>() << r.by_hand_eye, r.by_body_from_marker;
  if (freedom.time_offset) by_shared.col(12) = r.by_time_offset;
  const Matrix6d weight = inverse_symmetric(chain_covariance(station.chain, noise));
  const double per_px = 1 / (sigma_px * sigma_px);
  const Matrix6d weighted = weight * r.by_camera_from_marker;
  return StationNormal{per_px * corners->information + r.by_camera_from_marker.transpose() * weighted,
                       by_shared.transpose() * weighted, by_shared.transpose() * weight * by_shared,
                       per_px * corners->gradient + weighted.transpose() * r.value,
                       by_shared.transpose() * (weight * r.value)};
}

/// One Gauss-Newton step of everything; the step against its own sigmas, squared. Empty where corners fall behind.
std::optional<double> step_all(std::span<const CornerStation> stations, HandEyeRefinement& at,
                               const TrackerNoise& noise, double sigma_px, const ChainFreedom& freedom) {
  const int size = freedom.parameters();
  Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(size);
  std::vector<StationNormal> normals;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    auto normal = normal_of(stations[i], at.camera_from_marker[i], at.state, noise, sigma_px, freedom);
    if (!normal) return std::nullopt;
    reduced += normal->aa - normal->ac * solve_symmetric(normal->cc, Matrix6Xd(normal->ac.transpose()));
    gradient += normal->a - normal->ac * solve_symmetric(normal->cc, normal->c);
    normals.push_back(*std::move(normal));
  }
  at.covariance = inverse_information(reduced);
  const Eigen::VectorXd step = -at.covariance * gradient;
  if (!step.allFinite()) return std::nullopt;
  at.state.camera_from_sensor = moved(at.state.camera_from_sensor, step.head<6>());
  at.state.body_from_marker = moved(at.state.body_from_marker, step.segment<6>(6));
  if (freedom.time_offset) at.state.time_offset_s += step[12];
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vector6d own = -solve_symmetric(normals[i].cc, Vector6d(normals[i].c + normals[i].ac.transpose() * step));
    at.camera_from_marker[i] = moved(at.camera_from_marker[i], own);
  }
  return step.dot(reduced * step);
}

ceres::Solver::Options options() {
  ceres::Solver::Options out;
  out.linear_solver_type = ceres::DENSE_SCHUR;
  out.max_num_iterations = 100;
  out.function_tolerance = 1e-10;
  out.initial_trust_region_radius = 1e8;
  out.logging_type = ceres::SILENT;
  return out;
}

}  // namespace

std::optional<HandEyeRefinement> refine_hand_eye(std::span<const CornerStation> stations,
                                                 std::span<const Transform<Camera, Marker>> starts,
                                                 const ChainState& start, const TrackerNoise& noise, double sigma_px,
                                                 bool time_offset) {
  PoseBlock hand_eye = block_of(start.camera_from_sensor);
  PoseBlock body = block_of(start.body_from_marker);
  double offset_s = start.time_offset_s;
  std::vector<PoseBlock> views;
  for (const auto& pose : starts) views.push_back(block_of(pose));

  ceres::Problem::Options ownership;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  PoseManifold manifold{ceres::EigenQuaternionManifold{}, ceres::EuclideanManifold<3>{}};
  ceres::HuberLoss huber(kCornerHuberSigmas);
  ceres::Problem problem(ownership);
  auto* ordering = new ceres::ParameterBlockOrdering;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    problem.AddParameterBlock(views[i].data(), 7, &manifold);
    ordering->AddElementToGroup(views[i].data(), 0);
    for (const SeenCorners& corners : stations[i].corners) {
      for (std::size_t k = 0; k < corners.view->points_px.size(); ++k)
        problem.AddResidualBlock(new CornerCost(corners, k, sigma_px), &huber, views[i].data());
    }
    problem.AddResidualBlock(new TrackedCost(stations[i].chain, noise), nullptr, views[i].data(), hand_eye.data(),
                             body.data(), &offset_s);
  }
  problem.SetManifold(hand_eye.data(), &manifold);
  problem.SetManifold(body.data(), &manifold);
  if (!time_offset) problem.SetParameterBlockConstant(&offset_s);
  for (double* block : {hand_eye.data(), body.data(), &offset_s}) ordering->AddElementToGroup(block, 1);

  ceres::Solver::Options how = options();
  how.linear_solver_ordering.reset(ordering);
  ceres::Solver::Summary summary;
  ceres::Solve(how, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;

  HandEyeRefinement out;
  out.state.camera_from_sensor = pose_of<Camera, Sensor>(hand_eye.data());
  out.state.body_from_marker = pose_of<TrackedBody, Marker>(body.data());
  out.state.time_offset_s = offset_s;
  for (const PoseBlock& view : views) out.camera_from_marker.push_back(pose_of<Camera, Marker>(view.data()));
  for (const auto& iteration : summary.iterations) out.cost_trace.push_back(iteration.cost);
  constexpr int kLastSteps = 12;
  constexpr double kSmallStep = 1e-22;  // against its own sigma, squared
  for (int i = 0; i < kLastSteps; ++i) {
    const auto step = step_all(stations, out, noise, sigma_px, {time_offset, false});
    if (!step) return std::nullopt;
    if (*step < kSmallStep) break;
  }
  return out;
}

}  // namespace birdseye::calibration
