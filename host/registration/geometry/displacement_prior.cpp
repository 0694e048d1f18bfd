#include "host/registration/geometry/displacement_prior.hpp"

#include <algorithm>
#include <cmath>

#include "host/deform/bezier_patch.hpp"

namespace birdseye::host {

namespace {
/// Standard deviations of a dent: across the way inwards, and along it. How deep a narrow push reaches shows nowhere.
struct Dent {
  double across_mm, deep_mm;
};
constexpr std::array kDents{Dent{12, 12}, Dent{20, 20}, Dent{16, 40}};
/// Where the place is not known better than this, dents of which the middle is so far off along an axis make up for it.
constexpr double kBeside_mm = 12;
constexpr Eigen::Index kMiddles = 7;

Eigen::Vector3d middle_mm(Eigen::Index n) {
  Eigen::Vector3d out = Eigen::Vector3d::Zero();
  if (n > 0) out[(n - 1) / 2] = n % 2 == 0 ? kBeside_mm : -kBeside_mm;
  return out;
}
}  // namespace

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

Eigen::Index PushBasis::unknowns() const {
  return 3 * kMiddles * static_cast<Eigen::Index>(kDents.size());
}

Eigen::Matrix3Xd PushBasis::at(const Eigen::Vector3d& place_in_patient_mm) const {
  Eigen::Matrix3Xd out(3, unknowns());
  Eigen::Index column = 0;
  for (Eigen::Index n = 0; n < kMiddles; ++n) {
    const Eigen::Vector3d away_mm = place_in_patient_mm - place_mm_ - middle_mm(n);
    const double deep_mm2 = std::pow(away_mm.dot(inwards_), 2), across_mm2 = away_mm.squaredNorm() - deep_mm2;
    for (const Dent& dent : kDents) {
      const double squared = across_mm2 / (dent.across_mm * dent.across_mm) + deep_mm2 / (dent.deep_mm * dent.deep_mm);
      out.middleCols<3>(column) = sigma_mm_ * std::exp(-0.5 * squared) * Eigen::Matrix3d::Identity();
      column += 3;
    }
  }
  return out;
}

Eigen::Matrix3d DisplacementPrior::covariance(const Eigen::Vector3d& place_in_patient_mm) const {
  Eigen::Matrix3d out = unfollowed_mm * unfollowed_mm * Eigen::Matrix3d::Identity();
  for (const GaussianPart& part : parts) out += part.sigma_mm * part.sigma_mm * Eigen::Matrix3d::Identity();
  if (!basis) return out;
  const Eigen::Matrix3Xd here = basis->at(place_in_patient_mm);
  return out + here * here.transpose();
}

}  // namespace birdseye::host
