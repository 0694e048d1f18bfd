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
    EXPECT_TRUE(history.push({i * kPeriodNs}, {200'000}, {pose.rotation(), pose.translation() + error}));
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
  history.push({0}, {}, moving(0));
  history.push({100'000'000}, {}, moving(0.1));
  EXPECT_EQ(history.at({50'000'000}).kind, PoseKind::refused);
  const PoseAnswer after = history.at({110'000'000});
  EXPECT_EQ(after.kind, PoseKind::refused) << "the speed is not known across the hole";
  EXPECT_NE(after.reason.find("there is 1"), std::string::npos) << after.reason;
}

/// One of the last readings was changed on the line by less than the driver sees: the line that three of them make
/// leads anywhere, and nothing tells so. Four tell.
TEST(PoseHistory, PredictsFromAsManyAsTellHowFarTheyScatter) {
  const auto damaged = [](int i) {
    const Transform<Tracker, Sensor> true_pose = moving(0.01 * i);
    return Transform<Tracker, Sensor>(true_pose.rotation(), true_pose.translation() + Eigen::Vector3d(15, 0, 0));
  };
  PoseHistory history;
  for (int i = 0; i < 3; ++i) history.push({i * 10'000'000}, {}, i == 2 ? damaged(i) : moving(0.01 * i));
  const PoseAnswer three = history.at({100'000'000});
  EXPECT_EQ(three.kind, PoseKind::refused);
  EXPECT_NE(three.reason.find("there are 3"), std::string::npos) << three.reason;
  history.push({30'000'000}, {}, moving(0.03));
  const PoseAnswer four = history.at({100'000'000});
  ASSERT_EQ(four.kind, PoseKind::predicted);
  const double off_mm = (four.tracker_from_sensor->translation() - moving(0.1).translation()).norm();
  EXPECT_GT(off_mm, 10);
  EXPECT_LT(off_mm, 3 * std::sqrt(3.0) * four.position_sigma_mm);
}

/// Of a tracker with few poses a second the line is laid through as many, from further back.
TEST(PoseHistory, ASlowTrackerIsPredictedFromFourPosesToo) {
  PoseHistory history;
  for (int i = 0; i < 4; ++i) history.push({i * 40'000'000}, {}, moving(0.04 * i));
  const PoseAnswer answer = history.at({140'000'000});
  ASSERT_EQ(answer.kind, PoseKind::predicted);
  EXPECT_LT((answer.tracker_from_sensor->translation() - moving(0.14).translation()).norm(),
            3 * std::sqrt(3.0) * answer.position_sigma_mm);
}

TEST(PoseHistory, AHoleEndsTheSmoothingWindow) {
  PoseHistory::Settings settings;
  settings.smoothing = Duration::from_ms(200);
  PoseHistory history(settings);
  // It was held elsewhere before the hole.
  for (int i = 0; i < 20; ++i) history.push({i * 10'000'000}, {}, moving(100));
  for (int i = 30; i < 60; ++i) history.push({i * 10'000'000}, {}, moving(i * 0.01));
  for (const std::int64_t ns : {310'000'000, 355'000'000, 600'000'000}) {
    const PoseAnswer answer = history.at({ns});
    ASSERT_TRUE(answer.tracker_from_sensor) << answer.reason;
    EXPECT_LT((answer.tracker_from_sensor->translation() - moving(static_cast<double>(ns) * 1e-9).translation()).norm(),
              1e-6);
  }
}

TEST(PoseHistory, RefusesPosesWhoseTimeIsUnsure) {
  PoseHistory history;
  for (int i = 0; i < 10; ++i) history.push({i * kPeriodNs}, {i < 5 ? 300'000 : 12'000'000}, moving(0));
  EXPECT_EQ(history.at({2 * kPeriodNs + 5}).kind, PoseKind::interpolated);
  EXPECT_NEAR(static_cast<double>(history.at({2 * kPeriodNs + 5}).time_sigma.ns), 300'000, 1);
  const PoseAnswer answer = history.at({8 * kPeriodNs});
  EXPECT_EQ(answer.kind, PoseKind::refused);
  EXPECT_FALSE(answer.tracker_from_sensor);
  EXPECT_NE(answer.reason.find("12.0 ms"), std::string::npos) << answer.reason;
}

/// A hand that swings by 30 mm at 0.6 Hz (0.43 m/s^2 at most), and a tracker with noise.
TEST(PoseHistory, APredictionKnowsHowItGetsWorse) {
  constexpr double kNoise_mm = 0.5;
  PoseHistory::Settings settings;
  settings.smoothing = Duration::from_ms(40);
  std::mt19937 rng(5);
  std::normal_distribution<double> noise(0, kNoise_mm);
  const auto swing = [](double t_s) { return Eigen::Vector3d(30 * std::sin(2 * M_PI * 0.6 * t_s), 0, 0); };
  double last_sigma = 0;
  for (const double ahead_s : {0.005, 0.02, 0.05, 0.09}) {
    double within_2 = 0, sigma = 0;
    constexpr int kTrials = 300;
    for (int trial = 0; trial < kTrials; ++trial) {
      PoseHistory history(settings);
      const double start_s = trial * 0.0137;
      double t_s = start_s;
      for (int i = 0; i < 30; ++i) {
        t_s = start_s + i * kPeriodNs * 1e-9;
        const Eigen::Vector3d error(noise(rng), noise(rng), noise(rng));
        history.push({std::llround(t_s * 1e9)}, {}, {Eigen::Matrix3d::Identity(), swing(t_s) + error});
      }
      const PoseAnswer answer = history.at({std::llround((t_s + ahead_s) * 1e9)});
      ASSERT_EQ(answer.kind, PoseKind::predicted);
      const double error = answer.tracker_from_sensor->translation().x() - swing(t_s + ahead_s).x();
      within_2 += std::abs(error) <= 2 * answer.position_sigma_mm ? 1 : 0;
      sigma += answer.position_sigma_mm / kTrials;
    }
    EXPECT_GT(within_2 / kTrials, 0.9) << ahead_s;
    EXPECT_GT(sigma, last_sigma);
    last_sigma = sigma;
  }
}

TEST(PoseHistory, APredictionIsNotOfTwoNeighboursNoise) {
  constexpr double kNoise_mm = 0.5, kAhead_s = 0.02;
  std::mt19937 rng(6);
  std::normal_distribution<double> noise(0, kNoise_mm);
  double squares = 0;
  constexpr int kTrials = 400;
  for (int trial = 0; trial < kTrials; ++trial) {
    PoseHistory history;
    double t_s = 0;
    for (int i = 0; i < 20; ++i) {
      t_s = i * kPeriodNs * 1e-9;
      history.push({std::llround(t_s * 1e9)}, {}, {Eigen::Matrix3d::Identity(), {50 * t_s + noise(rng), 0, 0}});
    }
    const PoseAnswer answer = history.at({std::llround((t_s + kAhead_s) * 1e9)});
    const double error = answer.tracker_from_sensor->translation().x() - 50 * (t_s + kAhead_s);
    squares += error * error / kTrials;
  }
  // By the two newest it would be 3.6 times the noise.
  EXPECT_LT(std::sqrt(squares), 1.5 * kNoise_mm);
}

TEST(PoseHistory, RefusesSamplesOutOfOrderAndStaysBounded) {
  PoseHistory::Settings settings;
  settings.capacity = 10;
  PoseHistory history(settings);
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(history.push({i * kPeriodNs}, {200'000}, moving(0)));
  EXPECT_FALSE(history.push({99 * kPeriodNs}, {200'000}, moving(0)));
  EXPECT_FALSE(history.push({5 * kPeriodNs}, {200'000}, moving(0)));
  EXPECT_EQ(history.at({50 * kPeriodNs}).kind, PoseKind::refused);
}

}  // namespace
}  // namespace birdseye
