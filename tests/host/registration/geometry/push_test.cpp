#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
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

/// Of where tissue is seen that lay there, mm rms, inwards and outwards: how far a ball turns about its middle shows
/// nowhere.
double expected_mm(const BelievedDeformation& found, const Eigen::Vector3d& rest_mm) {
  const Eigen::Vector3d outwards = rest_mm.normalized();
  return std::sqrt(outwards.dot(found.covariance(rest_mm) * outwards));
}

/// As far from the ball's middle as the pushed place, and as well seen.
Eigen::Vector3d beside(const Eigen::Vector3d& pushed_mm) {
  constexpr double kRight_angle = 0.5 * std::numbers::pi;
  return Eigen::AngleAxisd(0.7 * kRight_angle, Eigen::Vector3d::UnitX()) * pushed_mm;
}

TEST(Push, ExpectsMoreWherePlacesThatLieTogetherAreLeftOff) {
  const SignedDistance organ = testing::ball(kOrganRadius_mm);
  const BelievedDeformation found = believed(organ, seen_by(dent), {gentle_prior()});
  EXPECT_GT(expected_mm(found, kPushed_mm), 2 * expected_mm(found, beside(kPushed_mm)));
  const double off_mm = (seen_place(found.mean, kPushed_mm) - (kPushed_mm - dent(kPushed_mm))).norm();
  EXPECT_LT(off_mm, 3 * expected_mm(found, kPushed_mm)) << "three deviations";
}

TEST(Push, ExpectsMoreDeepBelowItThanAsDeepElsewhere) {
  const SignedDistance organ = testing::ball(kOrganRadius_mm);
  const auto points = seen_by(dent);
  const auto with = believe(organ, points, push_hypotheses_of(kPushed_mm, -kPushed_mm.normalized()),
                            believed(organ, points, {gentle_prior()}), {});
  ASSERT_TRUE(with);
  const Eigen::Vector3d deep_mm = kPushed_mm - 35 * kPushed_mm.normalized();
  EXPECT_GT(expected_mm(*with, deep_mm), expected_mm(*with, beside(deep_mm)));
  // A push of 12 mm that reaches 40 mm deep moves that place by 8 mm, one that reaches 20 mm by 2.6 mm.
  EXPECT_GT(expected_mm(*with, deep_mm), 0.5 * (8.2 - 2.6));
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
