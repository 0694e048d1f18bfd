#include "host/registration/geometry/landmark_rays.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

namespace birdseye::host {
namespace {

const Eigen::Vector3d kRest_mm(4, -3, 118), kSeen_mm(12, 5, 125);
constexpr double kRestSigma_mm = 1e-3;

CameraModel lens() {
  CameraModel camera{768, 576, 700, 705, 380, 290};
  camera.k1 = -0.25;
  camera.k2 = 0.08;
  camera.p1 = 1e-3;
  return camera;
}

/// Of a camera that is turned by degrees about an axis through a place 120 mm before it, what it shows of kSeen_mm.
LandmarkPixel shown(double degrees, double sigma_px) {
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d about(0, 0, 120);
  LandmarkPixel out{"view.png", lens(), {turn, about - turn * about}, {}, sigma_px};
  out.pixel_px = *project(out.camera, out.camera_from_patient * kSeen_mm);
  return out;
}

TEST(LandmarkRays, OfExactPixelsMeetAtThePlace) {
  const std::vector<LandmarkPixel> pixels{shown(-15, 1), shown(20, 1)};
  const auto matched = matched_by_rays(kRest_mm, kRestSigma_mm, pixels);
  ASSERT_TRUE(matched) << matched.error().what;
  EXPECT_EQ(matched->rest_mm, kRest_mm);
  EXPECT_LT((matched->seen_mm - kSeen_mm).norm(), 2e-3);  // that it may have moved by 50 mm pulls by so little
}

TEST(LandmarkRays, TheirCovarianceIsThatOfThePlacesTheyGive) {
  constexpr double kSigma_px = 1.5;
  constexpr int kTrials = 2000;
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, kSigma_px);
  std::vector<LandmarkPixel> pixels{shown(-15, kSigma_px), shown(4, kSigma_px), shown(20, kSigma_px)};
  const Eigen::Matrix3d expected = matched_by_rays(kRest_mm, kRestSigma_mm, pixels)->covariance_mm2;
  const std::vector<LandmarkPixel> exact = pixels;
  Eigen::Matrix3d actual = Eigen::Matrix3d::Zero();
  for (int trial = 0; trial < kTrials; ++trial) {
    for (std::size_t n = 0; n < pixels.size(); ++n)
      pixels[n].pixel_px = exact[n].pixel_px + Eigen::Vector2d(noise(random), noise(random));
    const Eigen::Vector3d off_mm = matched_by_rays(kRest_mm, kRestSigma_mm, pixels)->seen_mm - kSeen_mm;
    actual += off_mm * off_mm.transpose() / kTrials;
  }
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> ratio(actual, expected);
  EXPECT_GT(ratio.eigenvalues().minCoeff(), 0.85);
  EXPECT_LT(ratio.eigenvalues().maxCoeff(), 1.15);
}

TEST(LandmarkRays, ASingleViewTellsOfNothingAlongItsRay) {
  const std::vector<LandmarkPixel> pixels{shown(20, 1)};
  const auto matched = matched_by_rays(kRest_mm, kRestSigma_mm, pixels);
  ASSERT_TRUE(matched);
  const Eigen::Vector3d eye_mm = pixels[0].camera_from_patient.inverse().translation();
  const Eigen::Vector3d ray = (kSeen_mm - eye_mm).normalized();
  // The place of the ray that is nearest to where the landmark was.
  const Eigen::Vector3d nearest_mm = eye_mm + ray * ray.dot(kRest_mm - eye_mm);
  EXPECT_LT((matched->seen_mm - nearest_mm).norm(), 0.01);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(matched->covariance_mm2);
  EXPECT_NEAR(std::sqrt(axes.eigenvalues()[2]), 50, 0.1);
  EXPECT_NEAR(std::abs(axes.eigenvectors().col(2).dot(ray)), 1, 1e-6);
  EXPECT_LT(std::sqrt(axes.eigenvalues()[1]), 0.3);
}

TEST(LandmarkRays, ViewsThatDisagreeAreBelievedLess) {
  std::vector<LandmarkPixel> pixels{shown(-15, 1), shown(20, 1)};
  const double sigma_mm = std::sqrt(matched_by_rays(kRest_mm, kRestSigma_mm, pixels)->covariance_mm2.trace());
  pixels[0].pixel_px.y() += 30;  // another thing
  const double disagreed_mm = std::sqrt(matched_by_rays(kRest_mm, kRestSigma_mm, pixels)->covariance_mm2.trace());
  EXPECT_GT(disagreed_mm, 10 * sigma_mm);
}

TEST(LandmarkRays, TheErrorOfItsPlaceInTheCtAddsUp) {
  const std::vector<LandmarkPixel> pixels{shown(-15, 1), shown(20, 1)};
  const Eigen::Matrix3d added =
      matched_by_rays(kRest_mm, 2, pixels)->covariance_mm2 - matched_by_rays(kRest_mm, 1, pixels)->covariance_mm2;
  EXPECT_LT((added - 3 * Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

TEST(LandmarkRays, RefuseWhatNoViewCanShow) {
  const auto refusal = [](const LandmarkPixel& pixel, double rest_sigma_mm = 1) {
    const auto matched = matched_by_rays(kRest_mm, rest_sigma_mm, std::vector{pixel});
    return matched ? std::string("none") : matched.error().what;
  };
  LandmarkPixel outside = shown(0, 1);
  outside.pixel_px.x() = 768;
  EXPECT_NE(refusal(outside).find("view.png: pixel 768"), std::string::npos) << refusal(outside);
  outside.pixel_px.x() = std::nan("");
  EXPECT_NE(refusal(outside).find("outside the picture"), std::string::npos);
  EXPECT_NE(refusal(shown(0, 0)).find("sigma_px is 0"), std::string::npos);
  EXPECT_NE(refusal(shown(0, 1), -1).find("sigma_mm is -1"), std::string::npos);
  LandmarkPixel behind = shown(0, 1);
  behind.camera_from_patient = Transform<Camera, Patient>(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, -500));
  EXPECT_NE(refusal(behind).find("behind a camera"), std::string::npos);
  LandmarkPixel folded = shown(0, 1);
  folded.camera.k1 = -2;
  folded.pixel_px = {1, 1};
  EXPECT_NE(refusal(folded).find("the lens sees nothing"), std::string::npos) << refusal(folded);
  EXPECT_FALSE(matched_by_rays(kRest_mm, 1, {}));
}

}  // namespace
}  // namespace birdseye::host
