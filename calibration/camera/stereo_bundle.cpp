#include "calibration/camera/stereo_bundle.hpp"

#include <ceres/cost_function.h>

#include <algorithm>
#include <memory>

#include "calibration/camera/bundle_solver.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kLens = CameraModel::kParameters;
constexpr int kBlocks = 4;
constexpr std::array<int, kBlocks> kSizes{kLens, kLens, 6, 6};  // left lens, right lens, relation, board's pose

template <int Columns>
using Rows = Eigen::Map<Eigen::Matrix<double, 2, Columns, Eigen::RowMajor>>;

/// A rotation that began at `start` and was turned by exp(turn), with the derivative of a turned point.
struct Turned {
  Eigen::Matrix3d rotation, by_turn;
  Turned(const double* turn, const Eigen::Matrix3d& start) {
    const Eigen::Vector3d w(turn[0], turn[1], turn[2]);
    rotation = rotation_exp(w) * start;
    by_turn = left_jacobian(w);
  }
};

class PairCost final : public ceres::CostFunction {
 public:
  PairCost(const StereoBundle& bundle, const BundlePair& pair) : bundle_(bundle), pair_(pair) {
    set_num_residuals(static_cast<int>(2 * (pair.left.points_mm.size() + pair.right.points_mm.size())));
    mutable_parameter_block_sizes()->assign(kSizes.begin(), kSizes.end());
  }

  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Turned pose(parameters[3], pair_.left.camera_from_marker.rotation());
    const Turned relation(parameters[2], bundle_.right_from_left.rotation());
    const Eigen::Map<const Eigen::Vector3d> at_mm(parameters[3] + 3), apart_mm(parameters[2] + 3);
    if (jacobians != nullptr) clear(jacobians);
    int row = 0;
    for (const bool right : {false, true}) {
      CameraModel camera = right ? bundle_.right : bundle_.left;
      set_parameters(camera, parameters[right ? 1 : 0]);
      const BundleView& view = right ? pair_.right : pair_.left;
      for (std::size_t i = 0; i < view.points_mm.size(); ++i, row += 2) {
        const Eigen::Vector3d turned = pose.rotation * view.points_mm[i];
        const Eigen::Vector3d turned_right = relation.rotation * (turned + at_mm);
        const Eigen::Vector3d point =
            right ? Eigen::Vector3d(turned_right + apart_mm) : Eigen::Vector3d(turned + at_mm);
        ProjectionJacobians by;
        const auto pixel = project(camera, point, &by);
        if (!pixel || !pixel->allFinite()) return false;
        const double root = std::sqrt(view.weights[i]);
        Eigen::Map<Eigen::Vector2d>(residuals + row) = root * (*pixel - view.points_px[i]);
        if (jacobians == nullptr) continue;
        if (double* lens = jacobians[right ? 1 : 0]; lens != nullptr)
          Rows<kLens>(lens + std::ptrdiff_t{kLens} * row) = root * by.by_parameter;
        if (right && jacobians[2] != nullptr) {
          Eigen::Matrix<double, 2, 6> d = pixel_by_pose(by.by_point, turned_right);
          d.leftCols<3>() *= relation.by_turn;
          Rows<6>(jacobians[2] + std::ptrdiff_t{6} * row) = root * d;
        }
        if (jacobians[3] != nullptr) {
          const Eigen::Matrix<double, 2, 3> by_left = right ? by.by_point * relation.rotation : by.by_point;
          Eigen::Matrix<double, 2, 6> d = pixel_by_pose(by_left, turned);
          d.leftCols<3>() *= pose.by_turn;
          Rows<6>(jacobians[3] + std::ptrdiff_t{6} * row) = root * d;
        }
      }
    }
    return true;
  }

 private:
  void clear(double** jacobians) const {
    for (std::size_t b = 0; b < kBlocks; ++b) {
      if (jacobians[b] != nullptr) std::fill_n(jacobians[b], num_residuals() * kSizes[b], 0.0);
    }
  }

  const StereoBundle& bundle_;
  const BundlePair& pair_;
};

template <typename To, typename From>
std::array<double, 6> still_at(const Transform<To, From>& t) {
  return {0, 0, 0, t.translation().x(), t.translation().y(), t.translation().z()};
}

template <typename To, typename From>
Transform<To, From> moved(const Transform<To, From>& start, const std::array<double, 6>& by) {
  const Eigen::Matrix3d rotation = rotation_exp(Eigen::Vector3d(by[0], by[1], by[2])) * start.rotation();
  return Transform<To, From>(Eigen::Quaterniond(rotation), Eigen::Vector3d(by[3], by[4], by[5]));
}

}  // namespace

void refine_stereo(StereoBundle& bundle, const BundleSettings& settings) {
  CameraVector left = parameters_of(bundle.left), right = parameters_of(bundle.right);
  std::array<double, 6> relation = still_at(bundle.right_from_left);
  std::vector<std::array<double, 6>> poses;
  for (const BundlePair& pair : bundle.pairs) poses.push_back(still_at(pair.left.camera_from_marker));
  ceres::Problem problem;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t p = 0; p < poses.size(); ++p) {
    problem.AddResidualBlock(new PairCost(bundle, bundle.pairs[p]), nullptr, left.data(), right.data(), relation.data(),
                             poses[p].data());
    ordering->AddElementToGroup(poses[p].data(), 0);
  }
  for (double* block : {left.data(), right.data(), relation.data()}) ordering->AddElementToGroup(block, 1);
  hold_unsolved(problem, left.data(), bundle.left_solved);
  hold_unsolved(problem, right.data(), bundle.right_solved);
  solve_bundle(problem, ordering, settings);
  bundle.right_from_left = moved(bundle.right_from_left, relation);
  for (std::size_t p = 0; p < poses.size(); ++p) {
    Transform<Camera, Marker>& pose = bundle.pairs[p].left.camera_from_marker;
    pose = moved(pose, poses[p]);
  }
  set_parameters(bundle.left, left.data());
  set_parameters(bundle.right, right.data());
}

Eigen::Matrix<double, 6, 6> relation_cofactor(const StereoBundle& bundle) {
  constexpr int kShared = 2 * kLens + 6;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(kShared, kShared);
  const CameraVector left = parameters_of(bundle.left), right = parameters_of(bundle.right);
  const std::array<double, 6> relation = still_at(bundle.right_from_left);
  for (const BundlePair& pair : bundle.pairs) {
    const PairCost cost(bundle, pair);
    const std::array<double, 6> pose = still_at(pair.left.camera_from_marker);
    const int rows = cost.num_residuals();
    using Dense = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    std::array<Dense, kBlocks> by;
    std::array<double*, kBlocks> pointers{};
    for (std::size_t b = 0; b < kBlocks; ++b) {
      by[b].resize(rows, kSizes[b]);
      pointers[b] = by[b].data();
    }
    Eigen::VectorXd residuals(rows);
    const double* const parameters[] = {left.data(), right.data(), relation.data(), pose.data()};
    if (!cost.Evaluate(parameters, residuals.data(), pointers.data())) continue;
    Eigen::MatrixXd shared(rows, kShared);
    shared << by[0], by[1], by[2];
    const Eigen::MatrixXd cross = shared.transpose() * by[3];
    const Eigen::MatrixXd of_pose = by[3].transpose() * by[3];
    information += shared.transpose() * shared - cross * solve_symmetric(of_pose, Eigen::MatrixXd(cross.transpose()));
  }
  std::vector<int> solved;
  for (int i = 0; i < kShared; ++i) {
    const auto k = static_cast<std::size_t>(i % kLens);
    if (i >= 2 * kLens || (i < kLens ? bundle.left_solved : bundle.right_solved)[k]) solved.push_back(i);
  }
  const Eigen::MatrixXd active = information(solved, solved);
  const Eigen::VectorXd unit = active.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = unit.asDiagonal() * active * unit.asDiagonal();
  return (unit.asDiagonal() * inverse_symmetric(scaled) * unit.asDiagonal()).bottomRightCorner<6, 6>();
}

std::vector<Eigen::Vector2d> right_residuals_px(const StereoBundle& bundle, const BundlePair& pair) {
  BundleView view = pair.right;
  const auto pose = bundle.right_from_left * pair.left.camera_from_marker;
  view.camera_from_marker = Transform<Camera, Marker>(pose.rotation(), pose.translation());
  return residuals_px(bundle.right, view);
}

}  // namespace birdseye::calibration
