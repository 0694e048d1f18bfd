#include "host/registration/geometry/lens_error.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <utility>

#include "host/registration/geometry/pinhole_view.hpp"

namespace birdseye::host {

namespace {

using Factor = Eigen::Matrix<double, CameraModel::kParameters, Eigen::Dynamic>;

/// The covariance's principal directions, each as long as its standard deviation.
Factor factor_of(const CameraMatrix& covariance) {
  constexpr double kNothing = 1e-6;  // of one parameter's own variance
  // In units in which each parameter's own sigma is 1: pixels and terms of distortion are no kin.
  const CameraVector unit = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const CameraVector per_unit = (unit.array() > 0).select(unit.cwiseInverse(), 0);
  const Eigen::SelfAdjointEigenSolver<CameraMatrix> eigen(per_unit.asDiagonal() * covariance * per_unit.asDiagonal());
  Factor out(CameraModel::kParameters, 0);
  for (Eigen::Index k = 0; k < CameraModel::kParameters; ++k) {
    if (!(eigen.eigenvalues()[k] > kNothing)) continue;
    out.conservativeResize(Eigen::NoChange, out.cols() + 1);
    out.rightCols<1>() = std::sqrt(eigen.eigenvalues()[k]) * unit.cwiseProduct(eigen.eigenvectors().col(k));
  }
  return out;
}

}  // namespace

LensError::LensError(const CameraModel& camera, Factor factor, Eigen::Index first, Eigen::Index of)
    : camera_(camera), factor_(std::move(factor)), first_(first), of_(of) {}

Eigen::Matrix2Xd LensError::directions_by(const Eigen::Vector2d& direction) const {
  Eigen::Matrix2Xd out = Eigen::Matrix2Xd::Zero(2, of_);
  ProjectionJacobians by;
  if (!project(camera_, direction.homogeneous(), &by)) return out;
  // The pixel stays: what the parameters move it by, the direction has to take back.
  const Eigen::Matrix2d by_direction = by.by_point.leftCols<2>();
  out.middleCols(first_, factor_.cols()) = -by_direction.inverse() * (by.by_parameter * factor_);
  return out;
}

std::vector<std::shared_ptr<const LensError>> lens_errors(std::span<const CameraModel> cameras,
                                                          std::span<const std::optional<CameraMatrix>> covariances) {
  const auto lens_of = [&](std::size_t n) {  // the first camera that is the same
    return static_cast<std::size_t>(std::ranges::find(cameras, cameras[n]) - cameras.begin());
  };
  std::vector<Factor> factors(cameras.size(), Factor(CameraModel::kParameters, 0));
  std::vector<Eigen::Index> first(cameras.size(), 0);
  Eigen::Index all = 0;
  for (std::size_t n = 0; n < covariances.size(); ++n) {
    if (lens_of(n) != n || !covariances[n]) continue;
    factors[n] = factor_of(*covariances[n]);
    first[n] = all;
    all += factors[n].cols();
  }
  std::vector<std::shared_ptr<const LensError>> out(cameras.size());
  for (std::size_t n = 0; all > 0 && n < cameras.size(); ++n) {
    const std::size_t lens = lens_of(n);
    out[n] = lens < n ? out[lens] : std::make_shared<const LensError>(cameras[n], factors[n], first[n], all);
  }
  return out;
}

ByLensErrors by_lens_errors(const Eigen::Vector3d& place_mm, std::span<const PinholeView* const> views) {
  if (views.empty() || !views.front()->lens_error) return ByLensErrors(3, 0);
  const Eigen::Index all = views.front()->lens_error->errors_of_all();
  const auto rows = static_cast<Eigen::Index>(2 * views.size());
  Eigen::MatrixX3d by_place(rows, 3);
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Zero(rows, all);
  for (std::size_t n = 0; n < views.size(); ++n) {
    const PinholeView& view = *views[n];
    const Eigen::Vector3d in_camera_mm = view.camera_from_patient * place_mm;
    const Eigen::Vector2d direction = in_camera_mm.hnormalized();
    Eigen::Matrix<double, 2, 3> by_camera;
    by_camera << Eigen::Matrix2d::Identity(), -direction;
    const auto row = static_cast<Eigen::Index>(2 * n);
    by_place.middleRows<2>(row) = by_camera / in_camera_mm.z() * view.camera_from_patient.rotation();
    wanted.middleRows<2>(row) = view.lens_error->directions_by(direction);
  }
  return by_place.completeOrthogonalDecomposition().solve(wanted);
}

}  // namespace birdseye::host
