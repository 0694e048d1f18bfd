#include "calibration/camera/board_flatness.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/geometry/linear_algebra.hpp"

namespace birdseye::calibration {

namespace {

constexpr int kShape = 3;
constexpr int kAll = CameraModel::kParameters + kShape;
using AllMatrix = Eigen::Matrix<double, kAll, kAll>;
using AllVector = Eigen::Matrix<double, kAll, 1>;

/// The board's middle, and half of its diagonal.
struct BoardExtent {
  Eigen::Vector2d middle_mm;
  double half_mm = 0;
};
BoardExtent extent_of(std::span<const BundleView> views) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(HUGE_VAL), high = -low;
  for (const BundleView& view : views) {
    for (const Eigen::Vector3d& p : view.points_mm) {
      low = low.cwiseMin(p.head<2>());
      high = high.cwiseMax(p.head<2>());
    }
  }
  return {(low + high) / 2, (high - low).norm() / 2};
}

/// The normal equations of lens and shape by one view, its pose eliminated.
struct ViewNormal {
  AllMatrix matrix = AllMatrix::Zero();
  AllVector vector = AllVector::Zero();
};
ViewNormal normal_by(const CameraModel& camera, const BundleView& view, const BoardExtent& board) {
  ViewNormal out;
  Eigen::Matrix<double, kAll, 6> cross = Eigen::Matrix<double, kAll, 6>::Zero();
  Matrix6d of_pose = Matrix6d::Zero();
  Vector6d pose_vector = Vector6d::Zero();
  ProjectionJacobians by;
  bool any = false;
  for (std::size_t i = 0; i < view.points_mm.size(); ++i) {
    const Eigen::Vector3d turned = view.camera_from_marker.rotation() * view.points_mm[i];
    if (!(view.weights[i] > 0)) continue;
    const auto pixel = project(camera, turned + view.camera_from_marker.translation(), &by);
    if (!pixel) continue;
    any = true;
    const Eigen::Vector2d at = (view.points_mm[i].head<2>() - board.middle_mm) / board.half_mm;
    const Eigen::RowVector3d shape(at.x() * at.x(), at.y() * at.y(), at.x() * at.y());
    Eigen::Matrix<double, 2, kAll> d;
    d << by.by_parameter, by.by_point * view.camera_from_marker.rotation().col(2) * shape;
    const Eigen::Matrix<double, 2, 6> p = pixel_by_pose(by.by_point, turned);
    const Eigen::Vector2d residual = view.points_px[i] - *pixel;
    out.matrix.noalias() += view.weights[i] * d.transpose() * d;
    out.vector.noalias() += view.weights[i] * d.transpose() * residual;
    cross.noalias() += view.weights[i] * d.transpose() * p;
    of_pose.noalias() += view.weights[i] * p.transpose() * p;
    pose_vector.noalias() += view.weights[i] * p.transpose() * residual;
  }
  if (!any) return {};
  out.matrix -= cross * solve_symmetric(of_pose, Matrix6Xd(cross.transpose()));
  out.vector -= cross * solve_symmetric(of_pose, pose_vector);
  return out;
}

/// The largest deviation from flatness at the edge, along any line through the middle.
double sag_of(const Eigen::Vector3d& shape) {
  Eigen::Matrix3d form = Eigen::Matrix3d::Zero();
  form.topLeftCorner<2, 2>() << shape[0], shape[2] / 2, shape[2] / 2, shape[1];
  return symmetric_eigenvalues(form).cwiseAbs().maxCoeff();
}

/// The step in the parameters that are free.
Eigen::VectorXd step_of(const AllMatrix& matrix, const AllVector& vector, const std::vector<int>& free) {
  return inverse_information(Eigen::MatrixXd(matrix(free, free))) * Eigen::VectorXd(vector(free));
}

}  // namespace

std::optional<BoardSag> find_board_sag(const CameraModel& camera, LensModel model, std::span<const BundleView> views) {
  constexpr std::size_t kFewestViews = 6;  // that tell how much three numbers of the shape differ by chance
  if (views.size() < kFewestViews) return std::nullopt;
  const BoardExtent board = extent_of(views);
  std::vector<ViewNormal> normals;
  ViewNormal all;
  for (const BundleView& view : views) {
    normals.push_back(normal_by(camera, view, board));
    all.matrix += normals.back().matrix;
    all.vector += normals.back().vector;
  }
  std::vector<int> free;
  for (int i = 0; i < CameraModel::kParameters; ++i) {
    if (solved_by(model).at(static_cast<std::size_t>(i))) free.push_back(i);
  }
  for (int i = CameraModel::kParameters; i < kAll; ++i) free.push_back(i);
  const Eigen::VectorXd step = step_of(all.matrix, all.vector, free);
  const Eigen::Vector3d shape = step.tail<kShape>();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  const auto count = static_cast<double>(views.size());
  for (const ViewNormal& one : normals) {
    const Eigen::VectorXd without = step_of(all.matrix - one.matrix, all.vector - one.vector, free);
    const Eigen::Vector3d change = without.tail<kShape>() - shape;
    spread += (count - 1) / count * change * change.transpose();
  }
  if (!step.allFinite() || !spread.allFinite()) return std::nullopt;
  BoardSag out;
  out.sag_mm = sag_of(shape);
  // Hotelling's T squared as the F it is distributed by: views are few.
  const double squared = shape.dot(solve_symmetric(spread, shape));
  out.standard_errors = std::sqrt(std::max(0.0, squared * (count - kShape) / (kShape * (count - 1))));
  for (std::size_t k = 0; k + kShape < free.size(); ++k) out.lens_change[free[k]] = step[static_cast<Eigen::Index>(k)];
  return out;
}

}  // namespace birdseye::calibration
