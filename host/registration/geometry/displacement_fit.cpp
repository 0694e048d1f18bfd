#include "host/registration/geometry/displacement_fit.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

/// What neighbouring residuals have wrong together: the surface's own error, and that of the views' poses.
constexpr double kShared_mm = 0.15, kSharedOver_mm = 8;

Eigen::MatrixXd gaussian(const Eigen::MatrixXd& squared_mm2, double length_mm) {
  return (squared_mm2.array() * (-0.5 / (length_mm * length_mm))).exp().matrix();
}

Eigen::MatrixXd squared_distances(const Eigen::MatrixX3d& a, const Eigen::MatrixX3d& b) {
  Eigen::MatrixXd out = -2 * a * b.transpose();
  out.colwise() += a.rowwise().squaredNorm();
  out.rowwise() += b.rowwise().squaredNorm().transpose();
  return out.cwiseMax(0.0);
}

}  // namespace

Eigen::MatrixX3d DisplacementFit::values(const Eigen::MatrixX3d& places) const {
  Eigen::MatrixX3d out = Eigen::MatrixX3d::Zero(places.rows(), 3);
  if (centres_.rows() == 0) return out;
  if (!prior_.parts.empty()) {
    const Eigen::MatrixXd squared = squared_distances(places, centres_);
    for (const GaussianPart& part : prior_.parts)
      out += part.sigma_mm * part.sigma_mm * (gaussian(squared, part.length_mm) * weights_of_centres_);
  }
  if (prior_.basis) out += prior_.basis->sum_at(unknowns_, places);
  return out;
}

std::vector<Eigen::Matrix3d> DisplacementFit::gradients(const Eigen::MatrixX3d& places) const {
  std::vector<Eigen::Matrix3d> out(static_cast<std::size_t>(places.rows()), Eigen::Matrix3d::Zero());
  if (centres_.rows() == 0) return out;
  if (!prior_.parts.empty()) {
    const Eigen::MatrixXd squared = squared_distances(places, centres_);
    for (const GaussianPart& part : prior_.parts) {
      const double scale = part.sigma_mm * part.sigma_mm / (part.length_mm * part.length_mm);
      const Eigen::MatrixXd k = gaussian(squared, part.length_mm);
      const Eigen::MatrixX3d sum = k * weights_of_centres_;
      for (Eigen::Index b = 0; b < 3; ++b) {
        const Eigen::MatrixX3d moved = k * (weights_of_centres_.array().colwise() * centres_.col(b).array()).matrix();
        for (Eigen::Index i = 0; i < places.rows(); ++i)
          out[static_cast<std::size_t>(i)].col(b) += scale * (moved.row(i) - places(i, b) * sum.row(i)).transpose();
      }
    }
  }
  if (prior_.basis) {
    constexpr double kStep_mm = 3;
    for (Eigen::Index b = 0; b < 3; ++b) {
      Eigen::MatrixX3d before = places, after = places;
      before.col(b).array() -= kStep_mm;
      after.col(b).array() += kStep_mm;
      const Eigen::MatrixX3d slope =
          (prior_.basis->sum_at(unknowns_, after) - prior_.basis->sum_at(unknowns_, before)) / (2 * kStep_mm);
      for (Eigen::Index i = 0; i < places.rows(); ++i)
        out[static_cast<std::size_t>(i)].col(b) += slope.row(i).transpose();
    }
  }
  return out;
}

DisplacementFit DisplacementFit::solve(const SignedDistance& organ, std::span<const SeenPoint> points,
                                       const DisplacementPrior& prior, const DisplacementFit* start,
                                       std::span<const double> scales_mm) {
  const auto n = static_cast<Eigen::Index>(points.size());
  DisplacementFit out;
  if (start != nullptr) {
    out.prior_ = start->prior_;
    out.centres_ = start->centres_;
    out.weights_of_centres_ = start->weights_of_centres_;
    out.unknowns_ = start->unknowns_;
  }
  out.weights_.assign(points.size(), 1);
  Eigen::MatrixX3d seen(n, 3);
  Eigen::VectorXd sigma(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    seen.row(i) = points[static_cast<std::size_t>(i)].place_mm.transpose();
    sigma[i] = points[static_cast<std::size_t>(i)].sigma_mm;
  }
  const Eigen::MatrixXd shared = kShared_mm * kShared_mm * gaussian(squared_distances(seen, seen), kSharedOver_mm);
  Eigen::MatrixX3d places = seen;  // that the function takes
  if (!prior.of_seen && start != nullptr) {
    for (int i = 0; i < 6; ++i) places = seen + out.values(places);
  }
  for (const double scale_mm : scales_mm) {
    if (!prior.of_seen) places = seen + out.values(places);
    const Eigen::MatrixX3d w = out.values(places);
    std::vector<Eigen::Matrix3d> slopes;
    if (!prior.of_seen) slopes = out.gradients(places);
    Eigen::MatrixX3d rows(n, 3);
    Eigen::VectorXd wanted(n), noise(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto m = static_cast<std::size_t>(i);
      const auto at = organ.sample(prior.of_seen ? Eigen::Vector3d((seen.row(i) + w.row(i)).transpose())
                                                 : Eigen::Vector3d(places.row(i).transpose()));
      Eigen::Matrix3d h = Eigen::Matrix3d::Identity();
      if (!prior.of_seen) {
        // A change of w moves the rest place of what is seen by (1 - dw/dr)^-1 of it.
        const Eigen::Matrix3d inverse = (Eigen::Matrix3d::Identity() - slopes[m]).inverse();
        constexpr double kTorn = 4;
        if (inverse.norm() < kTorn) h = inverse;
      }
      rows.row(i) = at.gradient.transpose() * h;
      wanted[i] = rows.row(i).dot(w.row(i)) - at.distance_mm;
      const double tempered = std::max(sigma[i], scale_mm > 1.01 ? scale_mm / 4 : 0.0);
      const double scale = std::max(scale_mm, 2.5 * sigma[i]);
      double weight = 1 / std::pow(1 + std::pow(at.distance_mm / scale, 2), 2);
      const auto& from_camera = points[m].from_camera;
      constexpr double kFacesAway = 0.15;
      if (from_camera && at.gradient.dot(*from_camera) > kFacesAway) weight = 1e-4;
      out.weights_[m] = weight;
      noise[i] = tempered * tempered / std::max(weight, 1e-5);
    }
    out.prior_ = prior;
    out.centres_ = places;
    out.rows_ = rows;
    Eigen::MatrixXd m = Eigen::MatrixXd::Zero(n, n);
    if (!prior.parts.empty()) {
      const Eigen::MatrixXd squared = squared_distances(places, places);
      for (const GaussianPart& part : prior.parts)
        m += part.sigma_mm * part.sigma_mm * gaussian(squared, part.length_mm);
      m.array() *= (rows * rows.transpose()).array();
    }
    if (prior.basis) {
      out.basis_rows_.resize(n, prior.basis->unknowns());
      for (Eigen::Index i = 0; i < n; ++i)
        out.basis_rows_.row(i) = rows.row(i) * prior.basis->at(places.row(i).transpose());
      m += out.basis_rows_ * out.basis_rows_.transpose();
    }
    m += shared;
    m.diagonal() += noise;
    out.factor_.compute(m);
    out.alpha_ = out.factor_.solve(wanted);
    out.weights_of_centres_ = rows.array().colwise() * out.alpha_.array();
    if (prior.basis) out.unknowns_ = out.basis_rows_.transpose() * out.alpha_;
    out.log_evidence_ =
        prior.log_belief - 0.5 * wanted.dot(out.alpha_) - out.factor_.matrixLLT().diagonal().array().log().sum();
  }
  return out;
}

Eigen::Matrix3d DisplacementFit::covariance(const Eigen::Vector3d& rest_mm, const Eigen::Vector3d& seen_mm) const {
  const Eigen::Vector3d place = prior_.of_seen ? seen_mm : rest_mm;
  Eigen::Matrix3d before = Eigen::Matrix3d::Zero();
  Eigen::MatrixX3d cross = Eigen::MatrixX3d::Zero(centres_.rows(), 3);
  for (const GaussianPart& part : prior_.parts) {
    const double s2 = part.sigma_mm * part.sigma_mm;
    const Eigen::VectorXd k = s2 * ((centres_.rowwise() - place.transpose()).rowwise().squaredNorm().array() *
                                    (-0.5 / (part.length_mm * part.length_mm)))
                                       .exp();
    cross.array() += rows_.array().colwise() * k.array();
    before += s2 * Eigen::Matrix3d::Identity();
  }
  if (prior_.basis) {
    const Eigen::Matrix3Xd here = prior_.basis->at(place);
    cross += basis_rows_ * here.transpose();
    before += here * here.transpose();
  }
  const Eigen::MatrixXd half = factor_.matrixL().solve(cross);
  return before - half.transpose() * half;
}

LatticeField DisplacementFit::seen_field(const SignedDistance& organ) const {
  constexpr std::size_t kBlock = 256;
  LatticeField field(organ);
  tbb::parallel_for(std::size_t{0}, (field.size() + kBlock - 1) / kBlock, [&](std::size_t block) {
    const std::size_t first = block * kBlock, last = std::min(field.size(), first + kBlock);
    Eigen::MatrixX3d places(static_cast<Eigen::Index>(last - first), 3);
    for (std::size_t i = first; i < last; ++i)
      places.row(static_cast<Eigen::Index>(i - first)) = field.place_mm(i).transpose();
    const Eigen::MatrixX3d w = values(places);
    for (std::size_t i = first; i < last; ++i) field.set(i, w.row(static_cast<Eigen::Index>(i - first)).transpose());
  });
  return prior_.of_seen ? field : seen_from_rest(field);
}

}  // namespace birdseye::host
