#include "host/registration/geometry/hypotheses.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace birdseye::host {

namespace {
constexpr double kUsual_mm = 2;
constexpr double kFewArePushed = -2;  ///< nats
/// What no hypothesis follows of an organ that moved by some kMoved_mm: of simulated bends and twists.
constexpr double kUnfollowed_mm = 0.2, kMoved_mm = 4;
}  // namespace

std::vector<DisplacementPrior> hypotheses_of(const Volume& ct, const std::shared_ptr<const ElasticModes>& modes,
                                             const std::array<int, 3>& control_points) {
  constexpr double kUsualNearby_mm = 0.4, kNearby_mm = 20;
  struct Gaussian {
    double length_mm, sigma_mm, nearby_sigma_mm;
  };
  std::vector<DisplacementPrior> out;
  for (const auto& [length, sigma, nearby] : {Gaussian{65, 4, 0},
                                              {85, 4, 0},
                                              {120, 4, 0},
                                              {120, 8, 0},
                                              {160, 4, 0},
                                              {160, 8, 0},
                                              {85, 2.5, 0},
                                              {120, 1, 0},
                                              {85, 1.2, 0.8},
                                              {85, 0.6, 1.6},
                                              {120, 1, 3}}) {
    DisplacementPrior prior;
    prior.name = fmt::format("{:g} mm over {:g} mm", sigma, length);
    prior.parts.push_back({length, sigma});
    if (nearby > 0) {
      prior.name += fmt::format(" and {:g} mm over {:g} mm", nearby, kNearby_mm);
      prior.parts.push_back({kNearby_mm, nearby});
    }
    prior.log_belief =
        -0.5 * std::pow(std::log(sigma / kUsual_mm), 2) - 0.5 * std::pow(std::log((nearby + 0.1) / kUsualNearby_mm), 2);
    prior.unfollowed_mm = kUnfollowed_mm * std::min(1.0, sigma / kMoved_mm);
    out.push_back(std::move(prior));
  }
  // No organ is quite one elastic material: an elastic hypothesis alone expects too small an error.
  struct Elastic {
    double sigma_mm, length_mm, beside_mm;
  };
  for (const auto& [sigma, length, beside] :
       {Elastic{0.5, 120, 2}, {0.5, 160, 4}, {1, 120, 2}, {1, 160, 4}, {2, 85, 2.5}, {1, 65, 4}}) {
    constexpr double kRigid_mm = 3;
    DisplacementPrior prior;
    prior.name = fmt::format("elastic, {:g} mm and {:g} mm over {:g} mm", sigma, beside, length);
    prior.basis = std::make_shared<ElasticBasis>(modes, kRigid_mm, sigma);
    prior.parts.push_back({length, beside});
    prior.log_belief = -0.5 * (std::pow(std::log(sigma / kUsual_mm), 2) + std::pow(std::log(beside / kUsual_mm), 2));
    prior.unfollowed_mm = kUnfollowed_mm;
    out.push_back(std::move(prior));
  }
  const Eigen::Vector3d last_voxel(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1);
  const Eigen::Affine3d patient_from_cube = ct.patient_from_voxel * Eigen::Scaling(last_voxel);
  for (const double sigma_mm : {20.0, 40.0}) {
    DisplacementPrior prior;
    prior.name = fmt::format("{}x{}x{} control points of {:g} mm", control_points[0], control_points[1],
                             control_points[2], sigma_mm);
    prior.basis = std::make_shared<BezierBasis>(patient_from_cube, control_points, sigma_mm);
    prior.of_seen = true;
    prior.unfollowed_mm = kUnfollowed_mm;
    out.push_back(std::move(prior));
  }
  return out;
}

std::vector<DisplacementPrior> push_hypotheses_of(const Eigen::Vector3d& place_mm, const Eigen::Vector3d& inwards) {
  constexpr double kPush_mm = 4;
  std::vector<DisplacementPrior> out;
  for (const auto& [length_mm, sigma_mm] : {GaussianPart{85, 0.6}, {85, 2.5}, {50, 2}}) {
    DisplacementPrior prior;
    prior.name = fmt::format("{:g} mm over {:g} mm and a push", sigma_mm, length_mm);
    prior.parts.push_back({length_mm, sigma_mm});
    prior.basis = std::make_shared<PushBasis>(place_mm, inwards, kPush_mm);
    prior.log_belief = -0.5 * std::pow(std::log(sigma_mm / kUsual_mm), 2) + kFewArePushed;
    prior.unfollowed_mm = kUnfollowed_mm;
    out.push_back(std::move(prior));
  }
  return out;
}

}  // namespace birdseye::host
