#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <random>
#include <utility>

#include "host/registration/geometry/believed_deformation.hpp"
#include "host/registration/geometry/displacement_fit.hpp"
#include "host/registration/geometry/gathered_points.hpp"
#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

constexpr double kBall_mm = 40;
constexpr std::array kDown_mm{8.0, 8.0, 6.0, 4.0, 3.0, 2.0, 1.5, 1.0, 1.0};

/// seen = rest - w(rest), of some millimetres over some 80.
Eigen::Vector3d bent(const Eigen::Vector3d& rest_mm) {
  return {4 * std::sin(rest_mm.y() / 50), 3 * std::cos(rest_mm.z() / 40), 3 * std::sin(rest_mm.x() / 45) - 2};
}

Eigen::Vector3d seen_of(const Eigen::Vector3d& rest_mm) {
  return rest_mm - bent(rest_mm);
}

/// A place of the ball's surface on the side of z that is asked for.
Eigen::Vector3d of_side(std::mt19937& random, double side) {
  std::normal_distribution<double> normal;
  for (;;) {
    Eigen::Vector3d place = kBall_mm * Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    if (side * place.z() > 8) return place;
  }
}

std::vector<SeenPoint> places_of_side(int number, double side, double noise_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_mm);
  std::vector<SeenPoint> out;
  for (int i = 0; i < number; ++i) {
    const Eigen::Vector3d rest_mm = of_side(random, side);
    out.push_back({seen_of(rest_mm) + noise(random) * rest_mm.normalized(), noise_mm, std::nullopt});
  }
  return out;
}

/// Places within and on the ball, matched with noise.
std::vector<MatchedPoint> landmarks(int number, double noise_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_mm);
  std::vector<MatchedPoint> out;
  for (int i = 0; i < number; ++i) {
    const Eigen::Vector3d rest_mm = 0.8 * of_side(random, i % 2 == 0 ? 1 : -1);
    const Eigen::Vector3d off_mm(noise(random), noise(random), noise(random));
    out.push_back({rest_mm, seen_of(rest_mm) + off_mm, noise_mm * noise_mm * Eigen::Matrix3d::Identity()});
  }
  return out;
}

DisplacementPrior bending() {
  DisplacementPrior prior;
  prior.parts.push_back({70, 4});
  return prior;
}

/// Root mean squares.
struct Errors {
  double hidden_mm = 0, inside_mm = 0, expected_hidden_mm = 0, expected_inside_mm = 0;
};

Errors errors_of(const SignedDistance& organ, const DisplacementFit& fit) {
  constexpr int kPlaces = 200;
  std::mt19937 random(17);
  const LatticeField field = fit.seen_field(organ);
  Eigen::Array4d squares = Eigen::Array4d::Zero();
  for (int i = 0; i < kPlaces; ++i) {
    const Eigen::Vector3d hidden = of_side(random, -1), inside = 0.5 * of_side(random, i % 2 == 0 ? 1 : -1);
    const Eigen::Vector3d hidden_now = seen_place(field, hidden), inside_now = seen_place(field, inside);
    squares[0] += (hidden_now - seen_of(hidden)).squaredNorm() / kPlaces;
    squares[1] += (inside_now - seen_of(inside)).squaredNorm() / kPlaces;
    squares[2] += fit.covariance(hidden, hidden_now).trace() / kPlaces;
    squares[3] += fit.covariance(inside, inside_now).trace() / kPlaces;
  }
  squares = squares.sqrt();
  return {squares[0], squares[1], squares[2], squares[3]};
}

/// Three variances along axes that are not the patient's.
Eigen::Matrix3d askew(const Eigen::Vector3d& sigma_mm) {
  const Eigen::Matrix3d axes =
      (Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(-0.4, Eigen::Vector3d::UnitY()))
          .toRotationMatrix();
  return axes * sigma_mm.cwiseAbs2().asDiagonal() * axes.transpose();
}

TEST(MatchedPoint, AloneIsARegressionWhoseAnswerIsKnown) {
  constexpr double kSigma_mm = 3;
  DisplacementPrior prior;
  prior.parts.push_back({60, kSigma_mm});
  const MatchedPoint point{{10, -5, 8}, {12, -4, 6.5}, askew({0.5, 1, 4})};
  const std::vector matched{point};
  const SignedDistance organ = testing::ball(kBall_mm);
  for (const bool of_seen : {false, true}) {
    prior.of_seen = of_seen;
    constexpr std::array<double, 30> kMany = [] {
      std::array<double, 30> out{};
      for (double& scale : out) scale = 1;
      return out;
    }();
    const DisplacementFit fit = DisplacementFit::solve(organ, {}, prior, nullptr, kMany, matched);
    const double weight = fit.matched_weights()[0];
    EXPECT_GT(weight, 0.1);
    EXPECT_LT(weight, 1);
    const Eigen::Matrix3d noise = point.covariance_mm2 / weight;
    const Eigen::Matrix3d before = kSigma_mm * kSigma_mm * Eigen::Matrix3d::Identity();
    const Eigen::Matrix3d gain = before * (before + noise).inverse();
    const Eigen::Vector3d wanted = point.rest_mm - point.seen_mm;
    const Eigen::Vector3d now = point.rest_mm - gain * wanted;
    // A prior of seen places takes the organ to move alike near the place, which it nearly does.
    const double bound = of_seen ? 0.01 : 1e-9;
    EXPECT_LT((fit.covariance(point.rest_mm, now) - (before - gain * before)).norm(), of_seen ? 0.05 : 1e-9);
    if (!of_seen) {
      EXPECT_NEAR(
          fit.log_evidence(),
          -0.5 * wanted.dot((before + noise).inverse() * wanted) - 0.5 * std::log((before + noise).determinant()),
          1e-9);
    }
    // The field is on a lattice of 2 mm.
    EXPECT_LT((seen_place(fit.seen_field(organ), point.rest_mm) - now).norm(), 0.02 + bound);
  }
}

TEST(MatchedPoint, GivesTheSameNearlyWhateverEndThePriorIsOf) {
  const SignedDistance organ = testing::ball(kBall_mm);
  for (const double along_mm : {0.5, 50.0}) {
    std::vector<MatchedPoint> matched = landmarks(40, 0.3, 4);
    std::mt19937 random(9);
    std::normal_distribution<double> noise;
    for (MatchedPoint& point : matched) {
      // Off along a ray by what is not known along it, or by what a ray tells.
      point.covariance_mm2 = askew({0.3, 0.3, along_mm});
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(point.covariance_mm2);
      point.seen_mm += std::min(along_mm, 8.0) * noise(random) * axes.eigenvectors().col(2);
    }
    DisplacementPrior prior = bending();
    const auto rest = DisplacementFit::solve(organ, {}, prior, nullptr, kDown_mm, matched);
    prior.of_seen = true;
    const auto seen = DisplacementFit::solve(organ, {}, prior, nullptr, kDown_mm, matched);
    const LatticeField by_rest = rest.seen_field(organ), by_seen = seen.seen_field(organ);
    for (const MatchedPoint& point : matched) {
      const Eigen::Vector3d off_mm = seen_place(by_seen, point.rest_mm) - seen_place(by_rest, point.rest_mm);
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(point.covariance_mm2);
      EXPECT_LT((axes.eigenvectors().leftCols<2>().transpose() * off_mm).norm(), 0.4);
    }
  }
}

TEST(FurtherRows, TouchesOfTheUnseenSideTellOfItAndOfTheInside) {
  const SignedDistance organ = testing::ball(kBall_mm);
  const std::vector<SeenPoint> stereo = places_of_side(150, 1, 0.25, 1);
  std::vector<SeenPoint> touched = stereo;
  const std::vector<SeenPoint> touches = places_of_side(40, -1, 1, 2);
  touched.insert(touched.end(), touches.begin(), touches.end());
  const Errors without = errors_of(organ, DisplacementFit::solve(organ, stereo, bending(), nullptr, kDown_mm));
  const Errors with = errors_of(organ, DisplacementFit::solve(organ, touched, bending(), nullptr, kDown_mm));
  EXPECT_LT(with.hidden_mm, 0.75 * without.hidden_mm);
  EXPECT_LT(with.inside_mm, 0.9 * without.inside_mm);
  EXPECT_LT(with.expected_hidden_mm, 0.75 * without.expected_hidden_mm);
  EXPECT_GT(with.expected_hidden_mm / with.hidden_mm, 0.6);
  EXPECT_LT(with.expected_hidden_mm / with.hidden_mm, 1.7);
}

/// All places by the views are off alike, as by a pose that the views' mean has wrong.
TEST(FurtherRows, TouchesTellOfWhatAllViewsHaveWrongTogether) {
  const Eigen::Vector3d off_mm(1.8, -1.4, 0.9);
  const SignedDistance organ = testing::ball(kBall_mm);
  std::vector<SeenPoint> unaware;
  for (const double side : {1.0, -1.0}) {
    for (const SeenPoint& point : places_of_side(120, side, 0.25, 1)) unaware.push_back(point);
  }
  for (SeenPoint& point : unaware) point.place_mm += off_mm;
  std::vector<SeenPoint> aware = unaware;
  for (SeenPoint& point : aware) point.by_common_mm.leftCols<3>() = 2 * Eigen::Matrix3d::Identity();
  const auto fit_of = [&](const std::vector<SeenPoint>& points) {
    return DisplacementFit::solve(organ, points, bending(), nullptr, kDown_mm);
  };
  const Errors sure = errors_of(organ, fit_of(unaware)), open = errors_of(organ, fit_of(aware));
  EXPECT_GT(sure.inside_mm, 1.8 * sure.expected_inside_mm);
  EXPECT_LT(open.inside_mm, 1.3 * open.expected_inside_mm);
  for (std::vector<SeenPoint>* points : {&unaware, &aware}) {
    for (const double side : {1.0, -1.0}) {
      for (const SeenPoint& touch : places_of_side(20, side, 0.3, 3)) points->push_back(touch);
    }
  }
  const DisplacementFit told = fit_of(aware);
  const Errors after = errors_of(organ, told);
  EXPECT_LT(after.inside_mm, 0.5 * errors_of(organ, fit_of(unaware)).inside_mm);
  EXPECT_LT(after.expected_inside_mm, 0.6 * open.expected_inside_mm);
  EXPECT_LT((2 * told.common_errors().head<3>() - off_mm).norm(), 0.5 * off_mm.norm());
  for (const double weight : told.weights()) EXPECT_GT(weight, 0.2);
}

TEST(FurtherRows, LandmarksTellOfHiddenAndInsideAndAWrongOneDoesNotMislead) {
  const SignedDistance organ = testing::ball(kBall_mm);
  const std::vector<SeenPoint> stereo = places_of_side(150, 1, 0.25, 1);
  std::vector<MatchedPoint> matched = landmarks(6, 1, 3);
  const Errors without = errors_of(organ, DisplacementFit::solve(organ, stereo, bending(), nullptr, kDown_mm));
  const Errors with = errors_of(organ, DisplacementFit::solve(organ, stereo, bending(), nullptr, kDown_mm, matched));
  EXPECT_LT(with.hidden_mm, 0.75 * without.hidden_mm);
  EXPECT_LT(with.inside_mm, 0.75 * without.inside_mm);
  EXPECT_LT(with.expected_inside_mm, 0.9 * without.expected_inside_mm);
  EXPECT_GT(with.expected_inside_mm / with.inside_mm, 0.6);
  EXPECT_LT(with.expected_inside_mm / with.inside_mm, 1.7);
  MatchedPoint wrong = landmarks(1, 1, 8).front();
  wrong.seen_mm += Eigen::Vector3d(12, -12, 10.6);  // 20 mm
  matched.push_back(wrong);
  const DisplacementFit misled = DisplacementFit::solve(organ, stereo, bending(), nullptr, kDown_mm, matched);
  const Errors after = errors_of(organ, misled);
  EXPECT_LT(after.hidden_mm, with.hidden_mm + 0.2);
  EXPECT_LT(after.inside_mm, with.inside_mm + 0.2);
  EXPECT_LT(misled.matched_weights().back(), 0.05);
  for (std::size_t i = 0; i + 1 < matched.size(); ++i) EXPECT_GT(misled.matched_weights()[i], 0.25);
}

TEST(FurtherRows, AreBelievedUnderEveryHypothesisAndWhereOneGoesOn) {
  const SignedDistance organ = testing::ball(kBall_mm);
  std::vector<DisplacementPrior> priors{bending(), bending(), bending()};
  priors[1].parts = {{50, 2}};
  priors[2].of_seen = true;
  const std::vector<SeenPoint> stereo = places_of_side(150, 1, 0.25, 1);
  const std::vector<MatchedPoint> matched = landmarks(8, 0.5, 3);
  auto found = believe(organ, stereo, priors, BelievedDeformation(organ), {}, matched);
  ASSERT_TRUE(found);
  found = believe(organ, stereo, priors, *found, {}, matched);
  ASSERT_TRUE(found);
  for (std::size_t n = 0; n < found->fits.size(); ++n) {
    ASSERT_EQ(found->fits[n].matched_weights().size(), matched.size());
    for (const MatchedPoint& point : matched)
      EXPECT_LT((seen_place(found->fields[n], point.rest_mm) - point.seen_mm).norm(), 2.5);
  }
}

/// Of the upper side of a ball at rest, shifted upwards by so much.
std::vector<SeenPoint> lifted(int number, double up_mm, double sigma_mm, double shift_mm, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<SeenPoint> out;
  for (int i = 0; i < number; ++i)
    out.push_back({of_side(random, 1) + up_mm * Eigen::Vector3d::UnitZ(), sigma_mm, std::nullopt, shift_mm});
  return out;
}

TEST(SeenPoint, WhatPlacesHaveWrongTogetherIsNotLessenedByTheirNumber) {
  const SignedDistance organ = testing::ball(kBall_mm);
  DisplacementPrior prior;
  prior.parts.push_back({400, 4});  // nearly a shift of all of the organ
  const auto up = [&](const std::vector<SeenPoint>& points) {
    const auto fit = DisplacementFit::solve(organ, points, prior, nullptr, kDown_mm);
    const Eigen::Vector3d now = seen_place(fit.seen_field(organ), Eigen::Vector3d::Zero());
    return std::pair(now.z(), std::sqrt(fit.covariance(Eigen::Vector3d::Zero(), now)(2, 2)));
  };
  // By themselves they are believed, and known as well as the shift is: of 4 mm before and 1 mm, 0.97 mm.
  const auto [alone_mm, alone_sigma_mm] = up(lifted(200, 1, 0.3, 1, 3));
  EXPECT_NEAR(alone_mm, 1, 0.15);
  EXPECT_NEAR(alone_sigma_mm, 0.97, 0.1);
  EXPECT_LT(up(lifted(200, 1, 0.3, 0, 3)).second, 0.5) << "as if each were new";
  // What tells of the organ without that shift, and is fewer, is believed more.
  for (const double shift_mm : {0.0, 1.0}) {
    std::vector<SeenPoint> points = lifted(40, 0, 0.5, 0, 5);
    const std::vector<SeenPoint> touches = lifted(200, 1, 0.3, shift_mm, 3);
    points.insert(points.end(), touches.begin(), touches.end());
    EXPECT_EQ(up(points).first<0.3, shift_mm> 0) << up(points).first;
  }
}

TEST(GatheredPoints, KeepTheShiftThatTheyHaveTogether) {
  const SeenSurface surface(testing::ball(kBall_mm));
  const std::vector<SeenPoint> touches = lifted(400, 1, 0.3, 0.8, 3);
  const std::vector<SeenPoint> gathered = gathered_points(touches, surface);
  EXPECT_LT(gathered.size(), touches.size() / 2);
  for (const SeenPoint& point : gathered) EXPECT_EQ(point.shift_mm, 0.8);
}

TEST(GatheredRows, OneTouchThreeHundredTimesIsOneAndWhatContradictsItStaysApart) {
  const SeenSurface surface(testing::ball(kBall_mm));
  const Eigen::Vector3d at(3, 4, kBall_mm), elsewhere(0, -kBall_mm, 3);
  std::vector<SeenPoint> rows(300, SeenPoint{at, 0.5, std::nullopt});
  rows.push_back({at - Eigen::Vector3d(0, 0, 6), 0.5, std::nullopt});
  rows.push_back({elsewhere, 0.01, std::nullopt});
  const GatheredRows out = gathered_rows(rows, surface);
  ASSERT_EQ(out.points.size(), 3U);
  ASSERT_EQ(out.of_row.size(), rows.size());
  for (std::size_t i = 1; i < 300; ++i) EXPECT_EQ(out.of_row[i], out.of_row[0]);
  const SeenPoint& many = out.points[out.of_row[0]];
  EXPECT_GE(many.sigma_mm, 0.15) << "no surer for being repeated";
  EXPECT_LT((many.place_mm - at).norm(), 0.01);
  EXPECT_NE(out.of_row[300], out.of_row[0]) << "6 mm off the others, at the same place";
  const SeenPoint& alone = out.points[out.of_row[301]];
  EXPECT_EQ(alone.place_mm, elsewhere) << "a row alone is as it is given";
  EXPECT_EQ(alone.sigma_mm, 0.15);
  for (const SeenPoint& point : out.points) EXPECT_GT(point.shift_mm, 0) << "what all rows have wrong together";
}

TEST(GatheredRows, AChainOfRowsThatAgreeEachWithTheNextIsNotOnePoint) {
  const SeenSurface surface(testing::ball(kBall_mm));
  std::vector<SeenPoint> rows;
  for (int i = 0; i < 8; ++i) rows.push_back({Eigen::Vector3d(3, 4, kBall_mm - 8 + i), 0.5, std::nullopt});
  const GatheredRows out = gathered_rows(rows, surface);
  EXPECT_GE(out.points.size(), 2U);
  EXPECT_NE(out.of_row.front(), out.of_row.back()) << "7 mm apart, of sigmas of 0.5 mm";
  EXPECT_EQ(out.of_row[0], out.of_row[1]);
}

}  // namespace
}  // namespace birdseye::host
