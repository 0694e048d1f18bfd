#include "host/registration/geometry/displacement_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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
