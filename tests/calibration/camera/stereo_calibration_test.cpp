// Two cameras that see the same boards.
#include "calibration/camera/stereo_calibration.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>

#include "calibration/base/units.hpp"
#include "calibration/points/point_error.hpp"
#include "tests/support/board_views.hpp"

namespace birdseye::calibration {
namespace {

using birdseye::testing::BoardScene;
using birdseye::testing::hd_lens;

/// A stereo laparoscope: 4.4 mm between its eyes, which look a little towards each other.
struct Pairs {
  BoardScene scene;
  CameraModel left = hd_lens(-0.22), right = hd_lens(-0.20);
  Transform<RightCamera, Camera> right_from_left{rotation_exp({0.004, -0.03, 0.01}), {-4.4, 0.05, 0.1}};
  std::vector<PatternView> left_views, right_views;

  explicit Pairs(int count, unsigned seed, double noise_px = 0.2) {
    scene.noise_px = noise_px;
    scene.columns = 8;
    scene.rows = 6;
    scene.pitch_mm = 8;
    std::mt19937 rng(seed + 500);
    for (const auto& pose : scene.poses(count, seed)) {
      const auto there = right_from_left * pose;
      const std::string name = "pair" + std::to_string(left_views.size());
      left_views.push_back(scene.view(left, pose, rng, name));
      right_views.push_back(scene.view(right, {there.rotation(), there.translation()}, rng, name));
    }
  }
  [[nodiscard]] Result<StereoCalibration> calibrate(int folds = 10) const {
    return calibrate_stereo(left_views, right_views, {1920, 1080}, {1920, 1080},
                            {.model = LensModel::radial1, .folds = folds});
  }
  /// What the answer is off by, in the covariance's terms.
  [[nodiscard]] Eigen::Matrix<double, 6, 1> error_of(const StereoCalibration& c) const {
    Eigen::Matrix<double, 6, 1> out;
    out << rotation_log(c.right_from_left.rotation() * right_from_left.rotation().transpose()),
        c.right_from_left.translation() - right_from_left.translation();
    return out;
  }
};

TEST(StereoCalibration, ExactPairsGiveTheRelationBack) {
  const Pairs pairs(10, 1, 0);
  const auto found = pairs.calibrate();
  ASSERT_TRUE(found) << found.error().what;
  EXPECT_LT(pairs.error_of(*found).head<3>().norm(), 1e-8);
  EXPECT_LT(pairs.error_of(*found).tail<3>().norm(), 1e-6);
  EXPECT_LT(found->epipolar_rms_px, 1e-5);
  EXPECT_LT(found->held_out_px, 1e-5);
  EXPECT_NEAR(found->left.camera.fx_px, pairs.left.fx_px, 1e-5);
  EXPECT_NEAR(found->right.camera.k1, pairs.right.k1, 1e-7);
}

TEST(StereoCalibration, CovarianceIsWhatChanceDoes) {
  constexpr int kSeeds = 40;
  double sum = 0;
  for (unsigned seed = 0; seed < kSeeds; ++seed) {
    const Pairs pairs(9, 20 + seed);
    const auto found = pairs.calibrate(2);
    ASSERT_TRUE(found) << found.error().what;
    const Eigen::Matrix<double, 6, 1> error = pairs.error_of(*found);
    sum += error.dot(found->covariance.ldlt().solve(error));
  }
  const double tail = chi_square_tail(sum, 6 * kSeeds);
  EXPECT_GT(tail, 0.005) << sum;
  EXPECT_LT(tail, 0.995) << sum;
}

TEST(StereoCalibration, TwentyPairsPassAndTheJointFitIsNoWorseThanNoise) {
  const Pairs pairs(20, 3);
  const auto found = pairs.calibrate();
  ASSERT_TRUE(found);
  EXPECT_EQ(judge_stereo(*found).grade, Grade::pass) << ::testing::PrintToString(judge_stereo(*found).reasons);
  EXPECT_NEAR(found->rms_px, 0.2 * std::sqrt(2.0), 0.02);
  // Across a line only one of two directions counts, and each point of the left picture adds its own noise.
  EXPECT_NEAR(found->epipolar_rms_px, 0.2 * std::sqrt(2.0), 0.05);
  EXPECT_NEAR(found->baseline_mm, pairs.right_from_left.translation().norm(), 0.1);
}

TEST(StereoCalibration, APairInWhichTheBoardMovedIsNamed) {
  Pairs pairs(14, 4);
  std::mt19937 rng(9);
  const auto moved = pairs.scene.poses(14, 4)[6];
  const auto there = pairs.right_from_left * moved;
  pairs.right_views[6] =
      pairs.scene.view(pairs.right, {there.rotation(), there.translation() + Eigen::Vector3d(3, -2, 5)}, rng, "pair6");
  const auto found = pairs.calibrate();
  ASSERT_TRUE(found) << found.error().what;
  ASSERT_EQ(found->rejected.size(), 1U);
  EXPECT_EQ(found->rejected[0].index, 6U);
  EXPECT_NE(found->rejected[0].reason.find("do not see the board at one place"), std::string::npos);
  EXPECT_EQ(found->pairs.size(), 13U);
  EXPECT_LT(pairs.error_of(*found).tail<3>().norm(), 0.2);
}

TEST(StereoCalibration, PicturesThatAreNoPairsAreRefusedOrFail) {
  Pairs pairs(12, 5);
  std::rotate(pairs.right_views.begin(), pairs.right_views.begin() + 1, pairs.right_views.end());
  const auto mixed = pairs.calibrate();
  EXPECT_TRUE(!mixed || judge_stereo(*mixed).grade == Grade::fail);
  pairs.right_views.pop_back();
  EXPECT_EQ(pairs.calibrate().error().code, Errc::bad_value);
  Pairs few(4, 6);
  for (std::size_t i = 0; i < 2; ++i) few.right_views[i].points_px[0].x() = NAN;
  const auto none = few.calibrate();
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, Errc::degenerate);
  EXPECT_NE(none.error().what.find("right camera"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::calibration
