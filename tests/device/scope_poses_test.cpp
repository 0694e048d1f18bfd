#include "device/birdseyed/scope_poses.hpp"

#include <gtest/gtest.h>

namespace birdseye::device {
namespace {

constexpr std::int64_t kCycleNs = 9'708'738;

Transform<Tracker, Sensor> moved(double x_mm) {
  return {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(x_mm, 0, 0)};
}

TEST(ScopePoses, MeasurementsOfUnknownTimeAreNotDrawnWith) {
  // Five cycles were lost on the line. Until the clock line has seen it, the poses come under times that are 49 ms old.
  ScopePoses poses{PoseHistory::Settings{}};
  for (int n = 0; n < 100; ++n) {
    const bool doubtful = n >= 50 && n < 58;
    const std::int64_t true_ns = (n < 50 ? n : n + 5) * kCycleNs;
    const std::int64_t stamped_ns = doubtful ? n * kCycleNs : true_ns;
    const double x_mm = static_cast<double>(true_ns) * 1e-9 * 400;  // 400 mm/s
    poses.push({stamped_ns}, doubtful ? Duration{5 * kCycleNs} : Duration{100'000}, moved(x_mm));
  }
  int refused = 0;
  for (std::int64_t t = kCycleNs; t < 100 * kCycleNs; t += 3'000'000) {
    const PoseAnswer answer = poses.at({t}, {0}, {});
    if (!answer.tracker_from_sensor) {
      ++refused;
      continue;
    }
    EXPECT_NEAR(answer.tracker_from_sensor->translation().x(), static_cast<double>(t) * 1e-9 * 400, 1e-3);
  }
  EXPECT_GT(refused, 30);
  EXPECT_LT(refused, 50);
}

}  // namespace
}  // namespace birdseye::device
