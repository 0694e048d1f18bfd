#include "host/registration/geometry/similarity_points.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "host/registration/geometry/displacement_fit.hpp"
#include "tests/support/ball.hpp"

namespace birdseye::host {
namespace {

constexpr double kSeenBall_mm = 40;

/// From 150 mm in front of the ball, in which everything counts.
PinholeView view_of_ball() {
  PinholeView out;
  out.width_px = 384;
  out.height_px = 288;
  out.fx_px = out.fy_px = 300;
  out.cx_px = 191.5;
  out.cy_px = 143.5;
  out.camera_from_patient = {Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, 150)};
  out.eye_in_patient_mm = Eigen::Vector3d(0, 0, -150);
  out.usable = cv::Mat(out.height_px, out.width_px, CV_8U, cv::Scalar(255));
  out.lens = out.usable.clone();
  return out;
}

/// rest = now + u everywhere, over a box that holds the ball.
DisplacementField shift(const Eigen::Vector3d& u_mm) {
  constexpr double kBox_mm = 200;
  DisplacementField out;
  out.size = {2, 2, 2};
  out.patient_from_lattice = Eigen::Translation3d(Eigen::Vector3d::Constant(-kBox_mm / 2)) * Eigen::Scaling(kBox_mm);
  out.displacement_mm.assign(8, u_mm.cast<float>());
  return out;
}

TEST(SimilarityPoints, LieOnTheSurfaceThatWasFoundWhereItFacesTheView) {
  const Eigen::Vector3d u_mm(4, 0, 3);
  const auto points = similarity_points({view_of_ball()}, testing::ball(kSeenBall_mm), shift(u_mm));
  EXPECT_GT(points.size(), 60U);
  for (const SeenPoint& point : points) {
    EXPECT_NEAR((point.place_mm + u_mm).norm(), kSeenBall_mm, 0.3);
    ASSERT_TRUE(point.from_camera);
    EXPECT_LT(point.from_camera->dot(point.place_mm + u_mm), 0);
    EXPECT_GT(point.broad_mm, point.sigma_mm);
  }
}

TEST(SimilarityPoints, WhatNeighboursHaveWrongTogetherIsNotAveragedAway) {
  const SignedDistance organ = testing::ball(kSeenBall_mm);
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<SeenPoint> alone, together;
  for (int i = 0; i < 300; ++i) {
    const Eigen::Vector3d outwards = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    alone.push_back({kSeenBall_mm * outwards, 0.4, std::nullopt});
    together.push_back(alone.back());
    together.back().broad_mm = 1.2;
  }
  DisplacementPrior prior;
  prior.parts.push_back({85, 3});
  constexpr std::array kSteps_mm{2.0, 1.0, 1.0};
  const auto sigma_mm = [&](const std::vector<SeenPoint>& points) {
    const DisplacementFit fit = DisplacementFit::solve(organ, points, prior, nullptr, kSteps_mm);
    const Eigen::Vector3d place_mm(0, 0, kSeenBall_mm);
    return std::sqrt(fit.covariance(place_mm, place_mm)(2, 2));
  };
  EXPECT_GT(sigma_mm(together), 3 * sigma_mm(alone));
  EXPECT_LT(sigma_mm(together), 1.2);
}

}  // namespace
}  // namespace birdseye::host
