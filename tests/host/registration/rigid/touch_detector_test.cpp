#include "host/registration/rigid/touch_detector.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace birdseye::host {
namespace {

constexpr double kRateHz = 103.3;

/// A tip that is parked, rests at each of points for dwell_s and glides between them in 0.5 s, then goes back.
std::vector<Touch> run(const std::vector<Eigen::Vector3d>& points, double noise_mm, double dwell_s) {
  std::mt19937 rng(7);
  std::normal_distribution<double> noise(0, noise_mm);
  const Eigen::Vector3d park(400, 100, 50);
  std::vector<Eigen::Vector3d> stops{park};
  stops.insert(stops.end(), points.begin(), points.end());
  stops.push_back(park);
  TouchDetector detector;
  std::vector<Touch> touches;
  double t_s = 0;
  const auto push = [&](const Eigen::Vector3d& p) {
    const Eigen::Vector3d noisy = p + Eigen::Vector3d(noise(rng), noise(rng), noise(rng));
    if (const auto touch = detector.push({Duration::from_seconds(t_s).ns}, noisy)) touches.push_back(*touch);
    t_s += 1 / kRateHz;
  };
  for (std::size_t i = 0; i < stops.size(); ++i) {
    for (int k = 0; k < dwell_s * kRateHz; ++k) push(stops[i]);
    if (i + 1 == stops.size()) break;
    for (int k = 0; k < 0.5 * kRateHz; ++k) {
      const double u = std::min(1.0, k / (0.5 * kRateHz));
      push(stops[i] + (stops[i + 1] - stops[i]) * (u * u * (3 - 2 * u)));
    }
  }
  return touches;
}

TEST(TouchDetector, FindsEachRestOnceAndNotTheParkingPlace) {
  const std::vector<Eigen::Vector3d> points{{200, 0, 0}, {260, 10, 0}, {260, 80, 20}, {200, 90, 5}};
  for (const double noise_mm : {0.0, 0.6}) {
    const std::vector<Touch> touches = run(points, noise_mm, 0.7);
    ASSERT_EQ(touches.size(), points.size()) << noise_mm;
    for (std::size_t i = 0; i < points.size(); ++i) {
      // Half a millimetre: what is left of the approach, plus four standard errors of the averaged noise.
      EXPECT_LT((touches[i].tip_in_tracker_mm - points[i]).norm(), 0.5) << i;
    }
  }
}

/// Nothing is seen of it while it goes from one place to the next.
TEST(TouchDetector, ARestEndsWhereTheTipIsNotSeen) {
  const Eigen::Vector3d park(400, 100, 50), first(200, 0, 0), second(260, 10, 0);
  TouchDetector detector;
  std::vector<Touch> touches;
  double t_s = 0;
  const auto rest = [&](const Eigen::Vector3d& at_mm) {
    for (int k = 0; k < 80; ++k, t_s += 1 / kRateHz)
      if (const auto touch = detector.push({Duration::from_seconds(t_s).ns}, at_mm)) touches.push_back(*touch);
  };
  rest(park);
  t_s += 0.4;  // parked on, unseen for a moment
  for (const Eigen::Vector3d& place : {park, first, second, park}) {
    rest(place);
    for (int k = 0; k < 20 && place == park; ++k, t_s += 1 / kRateHz)
      (void)detector.push({Duration::from_seconds(t_s).ns}, park + (first - park) * (k / 20.0));
    t_s += 0.5;
  }
  ASSERT_EQ(touches.size(), 2U);
  EXPECT_LT((touches[0].tip_in_tracker_mm - first).norm(), 0.01);
  EXPECT_LT((touches[1].tip_in_tracker_mm - second).norm(), 0.01);
}

TEST(TouchDetector, AShortStopIsNoTouch) {
  EXPECT_TRUE(run({{200, 0, 0}}, 0.3, 0.1).empty());
}

}  // namespace
}  // namespace birdseye::host
