#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "host/registration/geometry/believed_deformation.hpp"
#include "host/registration/geometry/hypotheses.hpp"
#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

constexpr double kOrganRadius_mm = 50;
const Eigen::Vector3d kPushed_mm(0, 0, kOrganRadius_mm);

/// seen = rest - w(rest): 12 mm into the organ, 40 mm wide at half the depth.
Eigen::Vector3d dent(const Eigen::Vector3d& rest_mm) {
  constexpr double kSigma_mm = 17;
  return {0, 0, 12 * std::exp(-0.5 * (rest_mm - kPushed_mm).squaredNorm() / (kSigma_mm * kSigma_mm))};
}

/// Evenly over the ball's half that faces up.
std::vector<Eigen::Vector3d> upper_half() {
  constexpr int kPlaces = 400;
  std::vector<Eigen::Vector3d> out;
  for (int i = 0; i < kPlaces; ++i) {
    const double z = (i + 0.5) / kPlaces, around = 2.399963 * i, r = std::sqrt(1 - z * z);
    out.push_back(kOrganRadius_mm * Eigen::Vector3d(r * std::cos(around), r * std::sin(around), z));
  }
  return out;
}

std::vector<SeenPoint> seen_by(const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& displacement) {
  std::mt19937 random(4);
  constexpr double kSigma_mm = 0.15;
  std::normal_distribution<double> noise(0, kSigma_mm);
  std::vector<SeenPoint> out;
  for (const Eigen::Vector3d& rest_mm : upper_half())
    out.push_back({rest_mm - displacement(rest_mm) + noise(random) * rest_mm.normalized(), kSigma_mm, std::nullopt});
  return out;
}

DisplacementPrior gentle_prior() {
  DisplacementPrior prior;
  prior.parts.push_back({85, 2.5});
  return prior;
}

BelievedDeformation believed(const SignedDistance& organ, std::span<const SeenPoint> points,
                             const std::vector<DisplacementPrior>& priors) {
  auto out = believe(organ, points, priors, BelievedDeformation(organ), {});
  EXPECT_TRUE(out);
  return *std::move(out);
}

double mean_error_mm(const LatticeField& seen) {
  double sum_mm = 0;
  const auto places = upper_half();
  for (const Eigen::Vector3d& rest_mm : places)
    sum_mm += (seen_place(seen, rest_mm) - (rest_mm - dent(rest_mm))).norm();
  return sum_mm / static_cast<double>(places.size());
}

TEST(Push, IsFoundWhereALongPriorLeavesTheSurfaceOff) {
  const SignedDistance organ = testing::ball(kOrganRadius_mm);
  const auto points = seen_by(dent);
  const auto pushed_mm = pushed_place_mm(organ, points, believed(organ, points, {gentle_prior()}).mean);
  ASSERT_TRUE(pushed_mm);
  EXPECT_LT((*pushed_mm - kPushed_mm).norm(), 15);
}

TEST(Push, ItsHypothesesAreBelievedAndLeaveLess) {
  const SignedDistance organ = testing::ball(kOrganRadius_mm);
  const auto points = seen_by(dent);
  const BelievedDeformation without = believed(organ, points, {gentle_prior()});
  // Not the middle itself, which is known to some millimetres only.
  auto with = believe(
      organ, points, push_hypotheses_of(kPushed_mm + Eigen::Vector3d(7, -5, 0), -kPushed_mm.normalized()), without, {});
  ASSERT_TRUE(with);
  EXPECT_GT(with->fits.front().log_evidence(), without.fits.front().log_evidence() + 50);
  // Of a ball no surface tells how far it turns about its middle, so that much is left by either.
  EXPECT_LT(mean_error_mm(with->mean), 0.65 * mean_error_mm(without.mean));
}

TEST(Push, IsNotFoundWhereALongPriorFollowsAll) {
  const SignedDistance organ = testing::ball(kOrganRadius_mm);
  const auto points = seen_by([](const Eigen::Vector3d& rest_mm) -> Eigen::Vector3d {
    return {3 * std::sin(rest_mm.y() / 60), 2, 3 * std::cos(rest_mm.x() / 60)};
  });
  EXPECT_FALSE(pushed_place_mm(organ, points, believed(organ, points, {gentle_prior()}).mean));
}

}  // namespace
}  // namespace birdseye::host
