#include "host/registration/geometry/expected_errors.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "host/registration/geometry/motion_evidence.hpp"
#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

constexpr double kOpenBall_mm = 40;

/// Places of a ball that moved by shift_mm, where it faces the patient's front.
std::vector<SeenPoint> seen_from_the_front(const Eigen::Vector3d& shift_mm) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::vector<SeenPoint> out;
  while (out.size() < 250) {
    const Eigen::Vector3d out_of_middle = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const double off_mm = kOpenBall_mm + 0.2 * normal(random);
    if (out_of_middle.y() < -0.2) out.push_back({off_mm * out_of_middle + shift_mm, 0.25, std::nullopt});
  }
  return out;
}

BelievedDeformation found_by(const SignedDistance& organ, std::span<const SeenPoint> points) {
  DisplacementPrior prior;
  prior.parts = {{30, 4}};
  const std::vector priors{prior};
  return *believe(organ, points, priors, BelievedDeformation(organ), {});
}

/// Upright, 300 mm in front of the patient.
PinholeView from_the_front() {
  PinholeView out;
  out.width_px = 400;
  out.height_px = 300;
  out.fx_px = out.fy_px = 800;
  out.cx_px = 200;
  out.cy_px = 150;
  Eigen::Matrix4d camera_from_patient = Eigen::Matrix4d::Identity();
  camera_from_patient.topLeftCorner<3, 3>() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  camera_from_patient(2, 3) = 300;
  out.camera_from_patient = Transform<Camera, Patient>::from_matrix(camera_from_patient);
  out.eye_in_patient_mm = out.camera_from_patient.inverse().translation();
  out.lens = cv::Mat(out.height_px, out.width_px, CV_8U, cv::Scalar(255));
  return out;
}

TEST(ExpectedErrors, LeaveOpenTheSideThatNothingIsKnownOf) {
  const SignedDistance organ = testing::ball(kOpenBall_mm);
  const BelievedDeformation found = found_by(organ, seen_from_the_front({0, 3, 0}));
  const std::vector views{from_the_front()};
  const std::vector<Eigen::Vector3d> targets{{0, -30, 0}, {0, 30, 0}};
  const ExpectedErrors expected = expected_errors(organ, found, views, targets);
  ASSERT_FALSE(expected.open.empty());
  EXPECT_EQ(expected.open.front().side, "back");
  EXPECT_GT(expected.open.front().share, 0.8);
  EXPECT_GT(expected.open.front().rms_mm, 3);
  for (const OpenSide& side : expected.open) EXPECT_NE(side.side, "front");
  EXPECT_LT(expected.seen->rms_mm, expected.hidden->rms_mm);
  EXPECT_LT(expected.targets[0].left_of_prior, expected.targets[1].left_of_prior);
  EXPECT_GT(expected.targets[1].left_of_prior, 0.8);
  EXPECT_NEAR(*expected.seen_moved_mm, 3, 0.8);
}

TEST(ExpectedErrors, OfWhatIsNotSeenAreThoseOfThePrior) {
  const Eigen::Matrix3d prior = 16 * Eigen::Matrix3d::Identity();
  EXPECT_NEAR(expected_error(prior, prior).left_of_prior, 1, 1e-12);
  const ExpectedError one_axis = expected_error(Eigen::Vector3d(4, 1e-9, 1e-9).asDiagonal(), prior);
  EXPECT_NEAR(one_axis.left_of_prior, 0.5, 1e-6);
  EXPECT_NEAR(one_axis.radius95_mm, 1.96 * 2, 0.05);
}

TEST(ExpectedErrors, OfWhatIsNoCovarianceAreBeyondAllLimits) {
  const Eigen::Matrix3d prior = 16 * Eigen::Matrix3d::Identity();
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double odd : {nan, inf, -4.0}) {
    const ExpectedError expected = expected_error(odd * Eigen::Matrix3d::Identity(), prior);
    EXPECT_EQ(expected.radius95_mm, inf) << odd;
    EXPECT_EQ(expected.left_of_prior, 1) << odd;
  }
}

TEST(Believe, NoFitWhoseRowsContradictOneAnother) {
  const SignedDistance organ = testing::ball(kOpenBall_mm);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<SeenPoint> points{{{0, -40, 0}, nan, std::nullopt}, {{0, -39, 9}, 0.2, std::nullopt}};
  DisplacementPrior prior;
  prior.parts = {{30, 4}};
  const std::vector priors{prior};
  EXPECT_FALSE(believe(organ, points, priors, BelievedDeformation(organ), {}));
}

TEST(MotionEvidence, IsHeldAgainstNoneByTheSameMatchedPoints) {
  const SignedDistance organ = testing::ball(kOpenBall_mm);
  DisplacementPrior prior;
  prior.parts = {{60, 4}};
  const std::vector priors{prior};
  for (const double shift_mm : {0.0, 3.0}) {
    std::vector<MatchedPoint> matched;
    for (const Eigen::Vector3d& rest : {Eigen::Vector3d(20, 0, 0), {-20, 0, 0}, {0, 20, 0}, {0, -20, 0}, {0, 0, 20}})
      matched.push_back({rest, rest + Eigen::Vector3d(0, shift_mm, 0), 0.01 * Eigen::Matrix3d::Identity()});
    const auto found = believe(organ, {}, priors, BelievedDeformation(organ), {}, matched);
    ASSERT_TRUE(found);
    const double nats = evidence_of_motion_nats(organ, {}, *found, matched);
    EXPECT_TRUE(shift_mm == 0 ? nats < 0 : nats > 3) << shift_mm << " mm: " << nats << " nats";
  }
}

TEST(MotionEvidence, GrowsWithTheMotionAndIsAgainstNone) {
  const SignedDistance organ = testing::ball(kOpenBall_mm);
  double before_nats = -std::numeric_limits<double>::infinity();
  for (const double shift_mm : {0.0, 1.0, 3.0}) {
    const auto points = seen_from_the_front({0, shift_mm, 0});
    const double nats = evidence_of_motion_nats(organ, points, found_by(organ, points));
    EXPECT_GT(nats, before_nats) << shift_mm;
    EXPECT_TRUE(shift_mm == 0 ? nats < 0 : nats > 3) << shift_mm << " mm: " << nats << " nats";
    before_nats = nats;
  }
}

}  // namespace
}  // namespace birdseye::host
