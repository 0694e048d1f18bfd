#include "host/registration/geometry/displacement_fit.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <span>

#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

constexpr double kRadius_mm = 40;
constexpr std::array kSettle_mm{4.0, 2.0, 1.3, 1.0, 1.0, 1.0};

/// seen = rest - w(rest), of some millimetres over some 80.
Eigen::Vector3d true_displacement(const Eigen::Vector3d& rest_mm) {
  return Eigen::Vector3d(3 * std::sin(rest_mm.y() / 60), 2 * std::cos(rest_mm.z() / 70),
                         1.5 * std::sin(rest_mm.x() / 50));
}

Eigen::Vector3d on_sphere(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return kRadius_mm * Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
}

std::vector<SeenPoint> seen_surface(double noise_mm) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, noise_mm);
  std::vector<SeenPoint> out;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d rest_mm = on_sphere(random);
    const Eigen::Vector3d seen_mm = rest_mm - true_displacement(rest_mm) + noise(random) * rest_mm.normalized();
    out.push_back({seen_mm, 0.25, std::nullopt});
  }
  return out;
}

DisplacementPrior long_prior() {
  DisplacementPrior prior;
  prior.parts.push_back({85, 3});
  return prior;
}

TEST(DisplacementFit, BringsTheSurfaceToWhereItIsSeen) {
  const SignedDistance organ = testing::ball(kRadius_mm);
  const auto points = seen_surface(0.2);
  const DisplacementFit fit = DisplacementFit::solve(organ, points, long_prior(), nullptr, kSettle_mm);
  const LatticeField field = fit.seen_field(organ);
  double squares_mm2 = 0;
  for (const SeenPoint& point : points)
    squares_mm2 += std::pow(organ.distance_mm(point.place_mm + field.at(point.place_mm)), 2);
  EXPECT_LT(std::sqrt(squares_mm2 / static_cast<double>(points.size())), 0.3);
}

TEST(DisplacementFit, ItsCovarianceHoldsItsErrors) {
  const SignedDistance organ = testing::ball(kRadius_mm);
  const DisplacementFit fit = DisplacementFit::solve(organ, seen_surface(0.2), long_prior(), nullptr, kSettle_mm);
  const LatticeField field = fit.seen_field(organ);
  std::mt19937 random(8);
  double actual_mm2 = 0, expected_mm2 = 0;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d rest_mm = 0.8 * on_sphere(random);
    const Eigen::Vector3d seen_mm = seen_place(field, rest_mm);
    actual_mm2 += (seen_mm - (rest_mm - true_displacement(rest_mm))).squaredNorm();
    const Eigen::Matrix3d covariance = fit.covariance(rest_mm, seen_mm);
    EXPECT_GT(covariance.diagonal().minCoeff(), 0);
    expected_mm2 += covariance.trace();
  }
  const double ratio = std::sqrt(expected_mm2 / actual_mm2);
  EXPECT_GT(ratio, 0.5);
  EXPECT_LT(ratio, 4);
}

TEST(DisplacementFit, AFewWrongPlacesChangeLittle) {
  const SignedDistance organ = testing::ball(kRadius_mm);
  auto points = seen_surface(0.2);
  const LatticeField without =
      DisplacementFit::solve(organ, points, long_prior(), nullptr, kSettle_mm).seen_field(organ);
  for (std::size_t i = 0; i < points.size(); i += 10) points[i].place_mm *= 1.2;
  constexpr std::array kAnneal_mm{8.0, 6.0, 4.0, 3.0, 2.0, 1.3, 1.0, 1.0, 1.0};
  const DisplacementFit fit = DisplacementFit::solve(organ, points, long_prior(), nullptr, kAnneal_mm);
  const LatticeField with = fit.seen_field(organ);
  for (const SeenPoint& point : seen_surface(0))
    EXPECT_LT((with.at(point.place_mm) - without.at(point.place_mm)).norm(), 0.6);
  EXPECT_LT(fit.weights()[0], 0.1);
}

TEST(DisplacementFit, TheEvidenceKnowsWhichPriorMadeTheField) {
  const SignedDistance organ = testing::ball(kRadius_mm);
  const auto points = seen_surface(0.2);
  DisplacementPrior still;
  still.parts.push_back({85, 0.2});
  EXPECT_GT(DisplacementFit::solve(organ, points, long_prior(), nullptr, kSettle_mm).log_evidence(),
            DisplacementFit::solve(organ, points, still, nullptr, kSettle_mm).log_evidence() + 50);
}

/// What a fit with a basis alone makes least: Geman and McClure's of the residuals, in standard deviations, and half
/// the squares of the unknowns. From the definition: no derivative of the fit's is used.
double cost_of(const Eigen::Vector3d& unknowns, const SignedDistance& organ, std::span<const SeenPoint> points,
               const DisplacementPrior& prior) {
  constexpr double kDeviations = 2.5;  // beyond which the fit thinks a residual wrong, once it is annealed
  double cost = 0.5 * unknowns.squaredNorm();
  for (const SeenPoint& point : points) {
    Eigen::Vector3d rest_mm = point.place_mm;
    for (int i = 0; i < (prior.of_seen ? 1 : 100); ++i)
      rest_mm = point.place_mm + prior.basis->at(prior.of_seen ? point.place_mm : rest_mm) * unknowns;
    const double deviations = organ.distance_mm(rest_mm) / point.sigma_mm;
    cost += 0.5 * deviations * deviations / (1 + std::pow(deviations / kDeviations, 2));
  }
  return cost;
}

TEST(DisplacementFit, EndsWhereCentralDifferencesOfItsCostVanish) {
  const SignedDistance organ = testing::ball(kRadius_mm);
  std::vector<SeenPoint> points;  // so far apart that they share no error
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const int axes = std::abs(x) + std::abs(y) + std::abs(z);
        if (axes != 1 && axes != 3) continue;
        const Eigen::Vector3d seen_mm = kRadius_mm * Eigen::Vector3d(x, y, z).normalized() - Eigen::Vector3d(9, -5, 7);
        points.push_back({seen_mm, 6, std::nullopt});
      }
    }
  }
  const Eigen::Affine3d box = Eigen::Translation3d(Eigen::Vector3d::Constant(-60)) * Eigen::Scaling(120.0);
  for (const bool of_seen : {true, false}) {
    DisplacementPrior prior;
    prior.basis = std::make_shared<BezierBasis>(box, std::array{1, 1, 1}, 60);
    prior.of_seen = of_seen;
    const std::vector<double> steps_mm(30, 1.0);
    const LatticeField field = DisplacementFit::solve(organ, points, prior, nullptr, steps_mm).seen_field(organ);
    const Eigen::Vector3d place_mm = field.place_mm(field.size() / 2), u_mm = field.at(place_mm);
    const Eigen::Matrix3d basis = prior.basis->at(of_seen ? place_mm : place_mm + u_mm);
    const Eigen::Vector3d found = basis.inverse() * u_mm;
    EXPECT_GT(u_mm.norm(), 4);
    Eigen::Vector3d gradient;
    Eigen::Matrix3d bend = Eigen::Matrix3d::Zero();
    constexpr double kStep = 1e-3;
    const auto cost = [&](const Eigen::Vector3d& at) { return cost_of(at, organ, points, prior); };
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3d along = kStep * Eigen::Vector3d::Unit(a);
      gradient[a] = (cost(found + along) - cost(found - along)) / (2 * kStep);
      bend(a, a) = (cost(found + along) - 2 * cost(found) + cost(found - along)) / (kStep * kStep);
    }
    // How far Newton's method would go on.
    EXPECT_LT((bend.inverse() * gradient).norm(), 0.01 * found.norm()) << of_seen;
  }
}

TEST(LatticeField, OfSeenPlacesUndoesThatOfRestPlaces) {
  const SignedDistance organ = testing::ball(kRadius_mm);
  LatticeField rest(organ);
  for (std::size_t n = 0; n < rest.size(); ++n) rest.set(n, true_displacement(rest.place_mm(n)));
  const LatticeField seen = seen_from_rest(rest);
  std::mt19937 random(2);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d rest_mm = 0.9 * on_sphere(random);
    EXPECT_LT((seen_place(seen, rest_mm) - (rest_mm - true_displacement(rest_mm))).norm(), 0.05);
  }
}

TEST(BezierBasis, HoldsStillAtTheBoxsFaces) {
  const BezierBasis basis(Eigen::Affine3d(Eigen::Scaling(100.0)), {3, 3, 3}, 40);
  EXPECT_EQ(basis.unknowns(), 81);
  EXPECT_NEAR(basis.at({50, 30, 0}).norm(), 0, 1e-12);
  EXPECT_NEAR(basis.at({100, 30, 20}).norm(), 0, 1e-12);
  EXPECT_GT(basis.at({50, 50, 50}).norm(), 1);
}

}  // namespace
}  // namespace birdseye::host
