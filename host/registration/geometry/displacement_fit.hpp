#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <span>
#include <vector>

#include "host/registration/geometry/displacement_prior.hpp"
#include "host/registration/geometry/lattice_field.hpp"
#include "host/registration/geometry/matched_point.hpp"
#include "host/registration/geometry/seen_point.hpp"
#include "host/volume/signed_distance.hpp"

namespace birdseye::host {

/// What neighbouring residuals have wrong together: the surface's own error, and that of the views' poses.
inline constexpr double kShared_mm = 0.15;

/// The displacement that surface points and matched points ask for under a prior, by Gauss and Newton's method on
/// distance(seen + displacement) = 0, and on seen + displacement = rest of what is matched, with Geman and McClure's
/// weights, annealed: the posterior of a Gaussian process about the best linearisation.
class DisplacementFit {
 public:
  /// start: where to begin; none: at rest. scales_mm: of each step, beyond which a residual is thought to be wrong.
  static DisplacementFit solve(const SignedDistance& organ, std::span<const SeenPoint> points,
                               const DisplacementPrior& prior, const DisplacementFit* start,
                               std::span<const double> scales_mm, std::span<const MatchedPoint> matched = {});

  /// u of seen places.
  [[nodiscard]] LatticeField seen_field(const SignedDistance& organ) const;
  /// Of where tissue is seen, mm^2: of tissue seen at seen_mm, which lay at rest_mm.
  [[nodiscard]] Eigen::Matrix3d covariance(const Eigen::Vector3d& rest_mm, const Eigen::Vector3d& seen_mm) const;
  /// Of the points under the prior, linearised where the fit ended, nats; with the prior's own belief. Minus
  /// infinity where rows contradict one another, or are no numbers: nothing else of such a fit is to be used.
  [[nodiscard]] double log_evidence() const { return log_evidence_; }
  [[nodiscard]] std::span<const double> weights() const { return weights_; }
  [[nodiscard]] std::span<const double> matched_weights() const { return matched_weights_; }
  [[nodiscard]] const DisplacementPrior& prior() const { return prior_; }
  /// What is found of the errors that all views share, in standard deviations; 0 where no point has them.
  [[nodiscard]] CommonErrors common_errors() const { return shared_.head<kCommonErrors>(); }

 private:
  /// Errors that points share: the views', the shift along three axes, and after them those of the lenses.
  static constexpr int kShared = kCommonErrors + 3;

  /// At many places at once.
  [[nodiscard]] Eigen::MatrixX3d values(const Eigen::MatrixX3d& places) const;
  /// [i](a, b) = d w_a / d x_b at place i.
  [[nodiscard]] std::vector<Eigen::Matrix3d> gradients(const Eigen::MatrixX3d& places) const;

  DisplacementPrior prior_;
  Eigen::MatrixX3d centres_ = Eigen::MatrixX3d(0, 3);  ///< of each row the place that the prior's function takes
  Eigen::MatrixX3d rows_ = Eigen::MatrixX3d(0, 3);     ///< by which a residual sees the displacement at its centre
  Eigen::MatrixXd basis_rows_;                         ///< the same of the basis's unknowns
  Eigen::VectorXd alpha_;
  Eigen::MatrixX3d weights_of_centres_ = Eigen::MatrixX3d(0, 3);
  Eigen::VectorXd unknowns_;  ///< of the basis
  Eigen::VectorXd shared_ = Eigen::VectorXd::Zero(kShared);
  Eigen::LLT<Eigen::MatrixXd> factor_;
  double log_evidence_ = 0;
  std::vector<double> weights_, matched_weights_;
};

}  // namespace birdseye::host
