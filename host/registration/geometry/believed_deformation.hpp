#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "host/registration/geometry/displacement_fit.hpp"
#include "host/registration/geometry/lattice_field.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Residuals are not as independent as the evidence has them (see docs/manual/registration.md): it is divided by this.
inline constexpr double kEvidenceTemper = 4;

/// How far a seen place is left off the surface, along its normal, as far as the place is thought to be wrong.
struct LeftOff {
  Eigen::Vector3d place_mm, off_mm;
};

/// Deformations by several hypotheses, how far each is believed, and their mean.
struct BelievedDeformation {
  explicit BelievedDeformation(const SignedDistance& organ) : mean(organ) {}

  std::vector<DisplacementFit> fits;  ///< of the hypotheses that are believed, the most believed first
  std::vector<LatticeField> fields;   ///< theirs, of seen places
  std::vector<double> beliefs;        ///< sum to 1
  LatticeField mean;
  std::vector<DisplacementFit> candidates;  ///< by all hypotheses that more points may yet speak for

  std::vector<LeftOff> left_off;  ///< of all points

  /// Of where tissue is seen that lay at rest_mm, mm^2: of each hypothesis, between hypotheses, and of what no
  /// hypothesis follows. Where points that lie together are left off to the same side, not the points are wrong but the
  /// hypotheses.
  [[nodiscard]] Eigen::Matrix3d covariance(const Eigen::Vector3d& rest_mm) const;
  /// The same before anything was seen.
  [[nodiscard]] Eigen::Matrix3d prior_covariance(const Eigen::Vector3d& rest_mm) const;
};

/// By every prior, each believed as far as its evidence goes. before: by fewer or worse points, of which the candidates
/// are gone on with; or empty of them. more: priors that are not among them. Empty where the watch cancels.
std::optional<BelievedDeformation> believe(const SignedDistance& organ, std::span<const SeenPoint> points,
                                           std::span<const DisplacementPrior> more, const BelievedDeformation& before,
                                           const RegistrationWatch& watch, std::span<const MatchedPoint> matched = {});

/// Where, at rest, the places of the surface that a deformation leaves off lie closest together: where something pushes
/// the organ more narrowly than the deformation follows. None where it leaves too few off.
std::optional<Eigen::Vector3d> pushed_place_mm(const SignedDistance& organ, std::span<const SeenPoint> points,
                                               const LatticeField& seen);

}  // namespace birdseye::host
