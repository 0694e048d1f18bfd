#include "host/registration/geometry/displacement_fit.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace birdseye::host {

namespace {

constexpr double kSharedOver_mm = 8, kBroadOver_mm = 25;

Eigen::MatrixXd gaussian(const Eigen::MatrixXd& squared_mm2, double length_mm) {
  return (squared_mm2.array() * (-0.5 / (length_mm * length_mm))).exp().matrix();
}

Eigen::MatrixXd squared_distances(const Eigen::MatrixX3d& a, const Eigen::MatrixX3d& b) {
  Eigen::MatrixXd out = -2 * a * b.transpose();
  out.colwise() += a.rowwise().squaredNorm();
  out.rowwise() += b.rowwise().squaredNorm().transpose();
  return out.cwiseMax(0.0);
}

/// What of a change of the displacement a place's other end moves by, where the displacement at that end has this
/// slope.
Eigen::Matrix3d carried(const Eigen::Matrix3d& slope) {
  constexpr double kTorn = 4;
  Eigen::Matrix3d inverse = (Eigen::Matrix3d::Identity() - slope).inverse();
  if (inverse.norm() < kTorn) return inverse;
  return Eigen::Matrix3d::Identity();
}

/// Of noise, by how far the fit is annealed.
double tempered(double sigma_mm, double scale_mm) {
  return std::max(sigma_mm, scale_mm > 1.01 ? scale_mm / 4 : 0.0);
}

/// Geman and McClure's, of a squared deviation in scales.
double robust_weight(double squared) {
  return 1 / std::pow(1 + squared, 2);
}

/// A matched point along the axes of its covariance.
struct MatchedAxes {
  explicit MatchedAxes(const MatchedPoint& point) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(point.covariance_mm2);
    axes = solver.eigenvectors();
    sigma_mm = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  }
  /// Of a point that is off by so much.
  [[nodiscard]] double weight(const Eigen::Vector3d& off_mm, double scale_mm) const {
    constexpr double kSigmas = 3.3;  // of three axes what 2.5 is of one
    const Eigen::Array3d scales = (kSigmas * sigma_mm.array()).max(scale_mm);
    return robust_weight(((axes.transpose() * off_mm).array() / scales).square().sum());
  }
  Eigen::Matrix3d axes;  ///< columns
  Eigen::Vector3d sigma_mm;
};

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
    // All at once: a sum begins with work of its own, however few its places are.
    constexpr double kStep_mm = 3;
    const Eigen::Index n = places.rows();
    Eigen::MatrixX3d beside = places.replicate<6, 1>();
    for (Eigen::Index b = 0; b < 3; ++b) {
      beside.middleRows(2 * b * n, n).col(b).array() -= kStep_mm;
      beside.middleRows((2 * b + 1) * n, n).col(b).array() += kStep_mm;
    }
    const Eigen::MatrixX3d sums = prior_.basis->sum_at(unknowns_, beside);
    for (Eigen::Index b = 0; b < 3; ++b) {
      for (Eigen::Index i = 0; i < n; ++i) {
        out[static_cast<std::size_t>(i)].col(b) +=
            (sums.row((2 * b + 1) * n + i) - sums.row(2 * b * n + i)).transpose() / (2 * kStep_mm);
      }
    }
  }
  return out;
}

DisplacementFit DisplacementFit::solve(const SignedDistance& organ, std::span<const SeenPoint> points,
                                       const DisplacementPrior& prior, const DisplacementFit* start,
                                       std::span<const double> scales_mm, std::span<const MatchedPoint> matched) {
  // A row of each point, then three of each matched point.
  const auto of_points = static_cast<Eigen::Index>(points.size());
  const auto of_matched = 3 * static_cast<Eigen::Index>(matched.size());
  const Eigen::Index n = of_points + of_matched;
  DisplacementFit out;
  if (start != nullptr) {
    out.prior_ = start->prior_;
    out.centres_ = start->centres_;
    out.weights_of_centres_ = start->weights_of_centres_;
    out.unknowns_ = start->unknowns_;
    out.shared_ = start->shared_;
  }
  Eigen::Index of_lenses = 0;
  for (const SeenPoint& point : points) of_lenses = std::max(of_lenses, point.by_lens_mm.cols());
  const Eigen::Index before = out.shared_.size(), all_shared = kShared + of_lenses;
  out.shared_.conservativeResize(all_shared);
  if (all_shared > before) out.shared_.tail(all_shared - before).setZero();
  out.weights_.assign(points.size(), 1);
  out.matched_weights_.assign(matched.size(), 1);
  Eigen::MatrixX3d known(n, 3);  // where a point is seen, and where what is matched was at rest
  Eigen::VectorXd sigma(of_points), broad(of_points);
  for (Eigen::Index i = 0; i < of_points; ++i) {
    known.row(i) = points[static_cast<std::size_t>(i)].place_mm.transpose();
    sigma[i] = points[static_cast<std::size_t>(i)].sigma_mm;
    broad[i] = points[static_cast<std::size_t>(i)].broad_mm;
  }
  std::vector<MatchedAxes> axes;
  axes.reserve(matched.size());
  for (const MatchedPoint& point : matched) axes.emplace_back(point);
  for (Eigen::Index i = 0; i < of_matched; ++i)
    known.row(of_points + i) = matched[static_cast<std::size_t>(i / 3)].rest_mm.transpose();
  const Eigen::MatrixX3d seen = known.topRows(of_points);
  const Eigen::MatrixXd apart_mm2 = squared_distances(seen, seen);
  Eigen::MatrixXd shared = kShared_mm * kShared_mm * gaussian(apart_mm2, kSharedOver_mm);
  if (broad.any()) shared += broad.asDiagonal() * gaussian(apart_mm2, kBroadOver_mm) * broad.asDiagonal();
  // Places that the function takes: where a row has its known end at the other one, it goes by the fit.
  Eigen::MatrixX3d places = known;
  const Eigen::Index first = prior.of_seen ? of_points : 0, moving = prior.of_seen ? of_matched : of_points;
  const double sign = prior.of_seen ? -1 : 1;  // rest = seen + u, or seen = rest - u
  const auto go_by_fit = [&] {
    places.middleRows(first, moving) =
        known.middleRows(first, moving) + sign * out.values(places.middleRows(first, moving));
  };
  if (start != nullptr) {
    for (int i = 0; i < 6; ++i) go_by_fit();
  }
  for (const double scale_mm : scales_mm) {
    go_by_fit();
    const Eigen::MatrixX3d w = out.values(places);
    const std::vector<Eigen::Matrix3d> slopes = out.gradients(places.middleRows(first, moving));
    // A change of the displacement moves the place that goes by the fit by so much of it.
    const auto carries = [&](Eigen::Index row) -> Eigen::Matrix3d {
      if (row < first || row >= first + moving) return Eigen::Matrix3d::Identity();
      return carried(sign * slopes[static_cast<std::size_t>(row - first)]);
    };
    Eigen::MatrixX3d rows(n, 3);
    Eigen::VectorXd wanted(n), noise(n);
    Eigen::MatrixXd by_shared = Eigen::MatrixXd::Zero(of_points, all_shared);
    for (Eigen::Index i = 0; i < of_points; ++i) {
      const auto m = static_cast<std::size_t>(i);
      const auto at = organ.sample(prior.of_seen ? Eigen::Vector3d((seen.row(i) + w.row(i)).transpose())
                                                 : Eigen::Vector3d(places.row(i).transpose()));
      rows.row(i) = at.gradient.transpose() * carries(i);
      wanted[i] = rows.row(i).dot(w.row(i)) - at.distance_mm;
      by_shared.row(i).head<kShared>() << rows.row(i) * points[m].by_common_mm, points[m].shift_mm * rows.row(i);
      by_shared.row(i).segment(kShared, points[m].by_lens_mm.cols()) = rows.row(i) * points[m].by_lens_mm;
      const double off_mm = at.distance_mm - by_shared.row(i).dot(out.shared_);
      double weight = robust_weight(std::pow(off_mm / std::max(scale_mm, 2.5 * sigma[i]), 2));
      const auto& from_camera = points[m].from_camera;
      constexpr double kFacesAway = 0.15;
      if (from_camera && at.gradient.dot(*from_camera) > kFacesAway) weight = 1e-4;
      out.weights_[m] = weight;
      noise[i] = std::pow(tempered(sigma[i], scale_mm), 2) / std::max(weight, 1e-5);
    }
    for (std::size_t m = 0; m < matched.size(); ++m) {
      const Eigen::Index row = of_points + 3 * static_cast<Eigen::Index>(m);
      const Eigen::Vector3d rest = matched[m].rest_mm, place = places.row(row).transpose();
      const Eigen::Vector3d now = prior.of_seen ? place : Eigen::Vector3d(rest - w.row(row).transpose());
      const double weight = axes[m].weight(now - matched[m].seen_mm, scale_mm);
      out.matched_weights_[m] = weight;
      rows.middleRows<3>(row) = axes[m].axes.transpose() * carries(row);
      wanted.segment<3>(row) =
          axes[m].axes.transpose() * (now - matched[m].seen_mm) + rows.middleRows<3>(row) * (rest - now);
      for (Eigen::Index k = 0; k < 3; ++k)
        noise[row + k] = std::pow(tempered(axes[m].sigma_mm[k], scale_mm), 2) / std::max(weight, 1e-5);
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
    m.topLeftCorner(of_points, of_points) += shared + by_shared * by_shared.transpose();
    m.diagonal() += noise;
    out.factor_.compute(m);
    out.alpha_ = out.factor_.solve(wanted);
    if (out.factor_.info() != Eigen::Success || !out.alpha_.allFinite()) {
      out.log_evidence_ = -std::numeric_limits<double>::infinity();
      return out;
    }
    out.shared_ = -(by_shared.transpose() * out.alpha_.head(of_points));
    out.weights_of_centres_ = rows.array().colwise() * out.alpha_.array();
    if (prior.basis) out.unknowns_ = out.basis_rows_.transpose() * out.alpha_;
    out.log_evidence_ =
        prior.log_belief - 0.5 * wanted.dot(out.alpha_) - out.factor_.matrixLLT().diagonal().array().log().sum();
  }
  return out;
}

Eigen::Matrix3d DisplacementFit::covariance(const Eigen::Vector3d& rest_mm, const Eigen::Vector3d& seen_mm) const {
  const Eigen::Vector3d place = prior_.of_seen ? seen_mm : rest_mm;
  Eigen::Matrix3d before = prior_.unfollowed_mm * prior_.unfollowed_mm * Eigen::Matrix3d::Identity();
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
  LatticeField field = sampled_field(organ, [this](const Eigen::MatrixX3d& places) { return values(places); });
  return prior_.of_seen ? field : seen_from_rest(field);
}

}  // namespace birdseye::host
