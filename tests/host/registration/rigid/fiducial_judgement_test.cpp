// What `register fiducials`, the live window, the demo and the replay hold against fiducials.
#include "host/registration/rigid/fiducial_judgement.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace birdseye::host {
namespace {

using Points = std::vector<Eigen::Vector3d>;

const Points kSound{{0, 0, 0}, {120, 10, 0}, {20, 140, 40}, {60, 40, 90}, {140, 120, 60}};
// Within 0.2 mm of a plane, less than a hand touches to.
const Points kFlat{{0, 0, 0}, {120, 10, 0.1}, {20, 140, 0.2}, {140, 120, 0}, {60, 40, 0.1}};

/// As a hand touches them, to 0.4 mm, by a tracker that stands elsewhere.
Points touched(const Points& ct_mm, double scale, double sign_of_x) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.4 / std::sqrt(3.0));
  const Eigen::AngleAxisd turn(0.7, Eigen::Vector3d(1, -2, 3).normalized());
  Points out;
  for (const Eigen::Vector3d& p : ct_mm) {
    const Eigen::Vector3d place(sign_of_x * p.x(), p.y(), p.z());
    out.emplace_back(turn * (scale * place) + Eigen::Vector3d(300, -20, 50) +
                     Eigen::Vector3d(noise(random), noise(random), noise(random)));
  }
  return out;
}

FiducialJudgement judged(const Points& ct_mm, double scale, double sign_of_x) {
  return judge_fiducial_points(ct_mm, touched(ct_mm, scale, sign_of_x), std::nullopt, {}, nullptr);
}

TEST(FiducialJudgement, NothingSpeaksAgainstSoundOnes) {
  const FiducialJudgement out = judged(kSound, 1, 1);
  EXPECT_FALSE(out.mirrored);
  EXPECT_FALSE(out.handedness_open);
  EXPECT_EQ(out.scale, Grade::pass);
  EXPECT_TRUE(out.outside.empty());
  EXPECT_TRUE(out.ct_reach.empty());
  EXPECT_FALSE(find_mirrored(kSound, touched(kSound, 1, 1)).has_value());
}

TEST(FiducialJudgement, AMirrorImageIsFoundWhicheverMarkerWasTouchedFirst) {
  EXPECT_TRUE(judged(kSound, 1, -1).mirrored);
  Points turned = touched(kSound, 1, -1);
  std::rotate(turned.begin(), turned.begin() + 2, turned.end());
  const auto out = find_mirrored(kSound, turned);
  ASSERT_TRUE(out.has_value());
  EXPECT_LT(out->shape.mirrored_fre_rms_mm, 1);
  EXPECT_GT(out->shape.fre_rms_mm, 15);
}

TEST(FiducialJudgement, OfFlatOnesTheHandednessIsOpen) {
  const FiducialJudgement out = judged(kFlat, 1, -1);
  EXPECT_TRUE(out.handedness_open);
  EXPECT_FALSE(out.mirrored);
  const Points three(kFlat.begin(), kFlat.begin() + 3);
  EXPECT_FALSE(judged(three, 1, 1).handedness_open) << "three are always flat";
}

TEST(FiducialJudgement, AScaleThatChanceDoesNotMakeFails) {
  EXPECT_EQ(judged(kSound, 1.05, 1).scale, Grade::fail);
  EXPECT_NEAR(judged(kSound, 1.05, 1).shape.scale, 1 / 1.05, 0.005);
  EXPECT_EQ(judged(kSound, 1.002, 1).scale, Grade::pass) << "what a sound CT and tracker may differ by";
  // Points that seem odd: of one that is off the others fit better than all do with a scale, of a scale they do not.
  calibration::OddPoints odd;
  odd.named = {{0, 9, ""}};
  odd.fre_without_rms_mm = 0.05;
  const Points scaled = touched(kSound, 1.05, 1);
  EXPECT_EQ(judge_fiducial_points(kSound, scaled, std::nullopt, odd, nullptr).scale, Grade::pass);
  odd.fre_without_rms_mm = 2;
  EXPECT_EQ(judge_fiducial_points(kSound, scaled, std::nullopt, odd, nullptr).scale, Grade::fail);
}

TEST(FiducialJudgement, AScaleAlongOneAxisFailsAndTheAxisIsNamed) {
  for (int axis = 0; axis < 3; ++axis) {
    Points ct_mm = kSound;
    for (Eigen::Vector3d& place : ct_mm) place[axis] *= 1.04;
    const FiducialJudgement out = judge_fiducial_points(ct_mm, touched(kSound, 1, 1), std::nullopt, {}, nullptr);
    EXPECT_EQ(out.scale, Grade::fail) << axis;
    EXPECT_TRUE(out.along_axis) << axis;
    EXPECT_EQ(out.shape.axis, axis);
    EXPECT_NEAR(out.shape.axis_scale, 1.04, 4 * out.shape.axis_scale_sigma);
  }
  EXPECT_FALSE(judged(kSound, 1.05, 1).along_axis) << "a scale of all axes is not one of one";
}

TEST(FiducialJudgement, SlicesAFifthAndMoreTooFarApartAreToldThoughNoScaleOfAllAxesFits) {
  for (const double times : {1.2, 1.5, 2.0, 0.5}) {
    Points ct_mm = kSound;
    for (Eigen::Vector3d& place : ct_mm) place.z() *= times;
    const FiducialJudgement out = judge_fiducial_points(ct_mm, touched(kSound, 1, 1), std::nullopt, {}, nullptr);
    EXPECT_GT(out.shape.fre_rms_mm, times > 1.3 || times < 1 ? kLargestFre_mm : 2);
    EXPECT_EQ(out.scale, Grade::fail) << times;
    EXPECT_TRUE(out.along_axis) << times;
    EXPECT_LT(out.axis_fre_rms_mm, 1) << times;
  }
  Points other_order = kSound;
  std::swap(other_order[0], other_order[3]);
  EXPECT_EQ(judge_fiducial_points(other_order, touched(kSound, 1, 1), std::nullopt, {}, nullptr).scale, Grade::pass)
      << "no slices make that of another order";
}

TEST(FiducialJudgement, ResidualsRefuteAStatedErrorThatIsHalfOfTheirsAndBearOutASoundOne) {
  constexpr int kTrials = 500;
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 0.4);
  int sound = 0, halved = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    // Six points leave 12 degrees of freedom.
    double squares = 0;
    for (int i = 0; i < 12; ++i) squares += std::pow(noise(random), 2);
    const double fre_mm = std::sqrt(squares / 6), true_mm = 0.4 * std::sqrt(3.0);
    sound += times_over_stated(fre_mm, 6, true_mm) ? 1 : 0;
    halved += times_over_stated(fre_mm, 6, true_mm / 2) ? 1 : 0;
  }
  EXPECT_LE(sound, 3) << "1 in 1000";
  EXPECT_GT(halved, 0.75 * kTrials);
  EXPECT_NEAR(times_over_stated(1.42, 6, 0.1).value_or(0), 1.42 * std::sqrt(18 / 12.0) / 0.1, 0.01);
  EXPECT_FALSE(times_over_stated(1.42, 6, 5)) << "larger than it is: nothing refutes that";
}

}  // namespace
}  // namespace birdseye::host
