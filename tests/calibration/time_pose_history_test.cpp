#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/time/pose_history.hpp"

namespace birdseye {
namespace {

constexpr std::int64_t kPeriodNs = 9'680'542;

Transform<Tracker, Sensor> moving(double t_s) {
  return {rotation_exp(Eigen::Vector3d(0.2, -0.1, 0.3) * t_s), Eigen::Vector3d(100 + 40 * t_s, -20 * t_s, 5)};
}

PoseHistory filled(const PoseHistory::Settings& settings, int samples, double noise_mm = 0) {
  PoseHistory history(settings);
  std::mt19937 rng(3);
  std::normal_distribution<double> noise(0, 1);
  for (int i = 0; i < samples; ++i) {
    const double t_s = i * kPeriodNs * 1e-9;
    const auto pose = moving(t_s);
    const Eigen::Vector3d error = noise_mm * Eigen::Vector3d(noise(rng), noise(rng), noise(rng));
    EXPECT_TRUE(history.push({i * kPeriodNs}, {pose.rotation(), pose.translation() + error}));
  }
  return history;
}

TEST(PoseHistory, SaysHowItCameByThePose) {
  const PoseHistory history = filled({}, 50);
  EXPECT_EQ(history.at({10 * kPeriodNs}).kind, PoseKind::exact);
  EXPECT_EQ(history.at({10 * kPeriodNs + 100}).kind, PoseKind::interpolated);
  EXPECT_EQ(history.at({50 * kPeriodNs}).kind, PoseKind::predicted);
  const PoseAnswer late = history.at({49 * kPeriodNs + 200'000'000});
  EXPECT_EQ(late.kind, PoseKind::refused);
  EXPECT_FALSE(late.tracker_from_sensor);
  EXPECT_NE(late.reason.find("200 ms"), std::string::npos);
  EXPECT_EQ(history.at({-5}).kind, PoseKind::refused);
  EXPECT_EQ(PoseHistory().at({0}).kind, PoseKind::refused);
}

TEST(PoseHistory, AConstantTwistIsFollowedExactly) {
  for (const std::int64_t smoothing_ms : {0, 40}) {
    PoseHistory::Settings settings;
    settings.smoothing = Duration::from_ms(smoothing_ms);
    const PoseHistory history = filled(settings, 100);
    for (const double t_s : {0.2, 0.3337, 0.51, 0.7}) {
      const PoseAnswer answer = history.at({static_cast<std::int64_t>(t_s * 1e9)});
      ASSERT_TRUE(answer.tracker_from_sensor);
      EXPECT_LT((answer.tracker_from_sensor->translation() - moving(t_s).translation()).norm(), 1e-5);
      EXPECT_LT(rotation_angle_between(answer.tracker_from_sensor->rotation(), moving(t_s).rotation()), 1e-7);
    }
  }
}

TEST(PoseHistory, SmoothingAveragesNoiseAndKnowsHowWell) {
  PoseHistory::Settings settings;
  settings.smoothing = Duration::from_ms(60);
  const PoseHistory history = filled(settings, 1000, 0.5);
  double squares = 0, sigma = 0;
  int n = 0;
  for (double t_s = 0.2; t_s < 9; t_s += 0.05) {
    const PoseAnswer answer = history.at({static_cast<std::int64_t>(t_s * 1e9)});
    squares += (answer.tracker_from_sensor->translation() - moving(t_s).translation()).squaredNorm() / 3;
    sigma += answer.position_sigma_mm;
    ++n;
  }
  // 12 samples: a standard error of 0.5 / sqrt(12) = 0.144 mm.
  EXPECT_NEAR(std::sqrt(squares / n), 0.144, 0.03);
  EXPECT_NEAR(sigma / n, 0.144, 0.03);
}

TEST(PoseHistory, DoesNotBridgeAHole) {
  PoseHistory history;
  history.push({0}, moving(0));
  history.push({100'000'000}, moving(0.1));
  EXPECT_EQ(history.at({50'000'000}).kind, PoseKind::refused);
}

TEST(PoseHistory, RefusesSamplesOutOfOrderAndStaysBounded) {
  PoseHistory::Settings settings;
  settings.capacity = 10;
  PoseHistory history(settings);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(history.push({i * kPeriodNs}, moving(0)));
  EXPECT_FALSE(history.push({99 * kPeriodNs}, moving(0)));
  EXPECT_FALSE(history.push({5 * kPeriodNs}, moving(0)));
  EXPECT_EQ(history.at({50 * kPeriodNs}).kind, PoseKind::refused);
}

}  // namespace
}  // namespace birdseye
