#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/time/clock_line.hpp"
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

ClockLine::Settings period_of(std::int64_t ns) {
  ClockLine::Settings settings;
  settings.period = {ns};
  return settings;
}

/// Arrivals: measurement n at n * period, late by at least delay and by an exponential tail.
struct Arrivals {
  std::mt19937 rng{11};
  std::exponential_distribution<double> tail{1.0 / 1.5e6};
  std::int64_t at(std::int64_t n) { return n * kPeriodNs + 5'000'000 + static_cast<std::int64_t>(tail(rng)); }
};

TEST(ClockLine, TakesTheJitterOut) {
  Arrivals arrivals;
  ClockLine line(period_of(kPeriodNs));
  double worst_ms = 0;
  for (std::int64_t n = 0; n < 1000; ++n) {
    const auto tick = line.push({arrivals.at(n)});
    if (n > 200) worst_ms = std::max(worst_ms, std::abs(static_cast<double>(tick.time.ns - n * kPeriodNs) * 1e-6 - 5));
  }
  EXPECT_LT(worst_ms, 0.1);
}

TEST(ClockLine, FollowsAPeriodThatIsALittleOff) {
  Arrivals arrivals;
  ClockLine line(period_of(kPeriodNs + 500));  // 50 ppm slow
  double worst_ms = 0;
  for (std::int64_t n = 0; n < 5000; ++n) {
    const auto tick = line.push({arrivals.at(n)});
    if (n > 200) worst_ms = std::max(worst_ms, std::abs(static_cast<double>(tick.time.ns - n * kPeriodNs) * 1e-6 - 5));
  }
  EXPECT_LT(worst_ms, 0.25);
}

TEST(ClockLine, SurvivesLostMeasurementsKnownAndUnknown) {
  for (const bool known : {true, false}) {
    Arrivals arrivals;
    ClockLine line(period_of(kPeriodNs));
    double worst_ms = 0;
    for (std::int64_t n = 0; n < 1000; ++n) {
      if (n == 500 || n == 501) continue;
      const auto tick = line.push({arrivals.at(n)}, known && n == 502 ? 2 : 0);
      const bool settled = n > 200 && (n < 500 || n > 515);
      if (settled) {
        worst_ms = std::max(worst_ms, std::abs(static_cast<double>(tick.time.ns - n * kPeriodNs) * 1e-6 - 5));
      }
    }
    EXPECT_LT(worst_ms, known ? 0.1 : 0.6) << known;
  }
}

TEST(ClockLine, NeverHidesThatMeasurementsMayBeMissing) {
  for (const std::int64_t lost : {1, 2, 3, 5, 20}) {
    Arrivals arrivals;
    ClockLine line(period_of(kPeriodNs));
    int doubted = 0;
    for (std::int64_t n = 0; n < 1000; ++n) {
      if (n >= 500 && n < 500 + lost) continue;
      const auto tick = line.push({arrivals.at(n)});
      const auto error_ns = std::abs(tick.time.ns - 5'000'000 - n * kPeriodNs);
      if (tick.sigma.ns > kPeriodNs * 7 / 10) {
        if (n >= 500 && n < 540) ++doubted;
        EXPECT_GT(tick.sigma.ns, error_ns - kPeriodNs / 20);
      } else if (n > 200) {
        EXPECT_LT(error_ns, 600'000) << lost << " lost, " << n;
      }
    }
    EXPECT_GE(doubted, 5) << lost;
    EXPECT_LE(doubted, 12) << lost;
  }
}

TEST(ClockLine, BeginsAnewAfterAJumpBack) {
  ClockLine line(period_of(kPeriodNs));
  for (std::int64_t n = 0; n < 100; ++n) line.push({n * kPeriodNs});
  const auto tick = line.push({80 * kPeriodNs});
  EXPECT_EQ(tick.time.ns, 80 * kPeriodNs);
  EXPECT_EQ(line.restarts(), 1U);
}

}  // namespace
}  // namespace birdseye
