#include "host/registration/geometry/displacement_prior.hpp"

#include <algorithm>

#include "host/deform/bezier_patch.hpp"

namespace birdseye::host {

Eigen::MatrixX3d DisplacementBasis::sum_at(const Eigen::VectorXd& unknowns, const Eigen::MatrixX3d& places) const {
  Eigen::MatrixX3d out(places.rows(), 3);
  for (Eigen::Index i = 0; i < places.rows(); ++i) out.row(i) = (at(places.row(i).transpose()) * unknowns).transpose();
  return out;
}

BezierBasis::BezierBasis(const Eigen::Affine3d& patient_from_cube, const std::array<int, 3>& inner_points,
                         double sigma_mm)
    : cube_from_patient_(patient_from_cube.inverse()), inner_(inner_points), sigma_mm_(sigma_mm) {}

Eigen::Index BezierBasis::unknowns() const {
  return Eigen::Index{3} * inner_[0] * inner_[1] * inner_[2];
}

Eigen::Matrix3Xd BezierBasis::at(const Eigen::Vector3d& place_in_patient_mm) const {
  const Eigen::Vector3d t = (cube_from_patient_ * place_in_patient_mm).cwiseMax(0.0).cwiseMin(1.0);
  const auto x = bernstein(inner_[0] + 1, t.x()), y = bernstein(inner_[1] + 1, t.y()),
             z = bernstein(inner_[2] + 1, t.z());
  Eigen::Matrix3Xd out = Eigen::Matrix3Xd::Zero(3, unknowns());
  Eigen::Index column = 0;
  for (std::size_t k = 1; k <= static_cast<std::size_t>(inner_[2]); ++k) {
    for (std::size_t j = 1; j <= static_cast<std::size_t>(inner_[1]); ++j) {
      for (std::size_t i = 1; i <= static_cast<std::size_t>(inner_[0]); ++i) {
        const double b = sigma_mm_ * x[i] * y[j] * z[k];
        for (Eigen::Index axis = 0; axis < 3; ++axis) out(axis, column++) = b;
      }
    }
  }
  return out;
}

}  // namespace birdseye::host
