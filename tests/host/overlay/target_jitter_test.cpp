#include "host/overlay/target_jitter.hpp"

#include <gtest/gtest.h>

#include <random>

namespace birdseye::host {
namespace {

/// A hand's sweep over a hundredth of a second's steps, with the tracker's noise on it.
TargetJitter after_a_sweep(double noise_mm, int poses, std::int64_t lost_at = -1) {
  TargetJitter jitter;
  std::mt19937 rng(5);
  std::normal_distribution<double> noise(0, noise_mm);
  for (int i = 0; i < poses; ++i) {
    // Times as a tracker's come, none exactly after another.
    const double t_s = 0.0097 * i + 0.001 * std::sin(1.7 * i) + (i > lost_at && lost_at >= 0 ? 5 : 0);
    const Eigen::Vector3d swept(60 * std::sin(0.9 * t_s), 40 * std::cos(1.3 * t_s), 100 + 12 * std::sin(t_s));
    const Eigen::Vector3d off(noise(rng), noise(rng), noise(rng));
    jitter.push({static_cast<std::int64_t>(t_s * 1e9)}, swept + off);
  }
  return jitter;
}

TEST(TargetJitter, IsTheNoiseAndNotTheHand) {
  ASSERT_TRUE(after_a_sweep(0.5, 70).rms_mm().has_value());
  // 64 of three axes each, each pose in three of them: 10 % is twice the standard deviation of the estimate.
  EXPECT_NEAR(*after_a_sweep(0.5, 70).rms_mm(), 0.5 * std::sqrt(3), 0.1 * 0.5 * std::sqrt(3));
  EXPECT_LT(*after_a_sweep(0, 70).rms_mm(), 0.01);
}

TEST(TargetJitter, SaysNothingOfAFewPoses) {
  EXPECT_FALSE(after_a_sweep(0.5, 11).rms_mm().has_value());
  EXPECT_TRUE(after_a_sweep(0.5, 12).rms_mm().has_value());
}

TEST(TargetJitter, TellsHowFastTheHandGoes) {
  EXPECT_FALSE(after_a_sweep(0, 2).speed_mm_s().has_value());
  // The sweep's own speed, by its derivative in the middle of the newest fifth of a second.
  const double t_s = 0.0097 * 69 - 0.1;
  const Eigen::Vector3d speed_mm_s(54 * std::cos(0.9 * t_s), -52 * std::sin(1.3 * t_s), 12 * std::cos(t_s));
  EXPECT_NEAR(*after_a_sweep(0, 70).speed_mm_s(), speed_mm_s.norm(), 0.3);
  EXPECT_NEAR(*after_a_sweep(0.5, 70).speed_mm_s(), speed_mm_s.norm(), 6) << "0.5 mm of noise over 20 poses";
}

TEST(TargetJitter, AGapIsNoNoise) {
  EXPECT_LT(*after_a_sweep(0, 70, 40).rms_mm(), 0.01);
}

}  // namespace
}  // namespace birdseye::host
