#include "calibration/guide/still_detector.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace birdseye::calibration {
namespace {

using Pose = Transform<Tracker, Sensor>;

/// Poses at 100 Hz with a miniBIRD's noise, of a scope that rests but for a move over 80 mm and 30 degrees in between.
struct Stream {
  static constexpr std::int64_t kLeaves_ms = 600, kArrives_ms = 1000, kEnd_ms = 1600;
  StillDetector detector;
  std::mt19937 rng{4};
  std::normal_distribution<double> normal;

  static Pose truth(std::int64_t ms) {
    const double share = std::clamp(static_cast<double>(ms - kLeaves_ms) / (kArrives_ms - kLeaves_ms), 0.0, 1.0);
    return {rotation_exp(Eigen::Vector3d(0, share * 30 * kRadPerDeg, 0)), Eigen::Vector3d(80 * share, 20, 200)};
  }
  Eigen::Vector3d noise(double sigma) { return sigma * Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); }
  void play(std::int64_t from_ms, std::int64_t to_ms) {
    for (std::int64_t ms = from_ms; ms <= to_ms; ms += 10) {
      const Pose p = truth(ms);
      detector.push(
          DeviceTime{} + Duration::from_ms(ms),
          {Eigen::Matrix3d(p.rotation() * rotation_exp(noise(0.1 * kRadPerDeg))), p.translation() + noise(0.3)});
    }
  }
  [[nodiscard]] bool still_at(std::int64_t ms) const { return detector.still_at(DeviceTime{} + Duration::from_ms(ms)); }
};

TEST(StillDetector, TellsRestFromMotion) {
  Stream stream;
  stream.play(0, Stream::kEnd_ms);
  for (std::int64_t ms = 200; ms < Stream::kEnd_ms - 50; ms += 10) {
    const bool rest = ms < Stream::kLeaves_ms - 40 || ms > Stream::kArrives_ms + 60;
    const bool moves = ms > Stream::kLeaves_ms + 30 && ms < Stream::kArrives_ms - 30;
    if (rest) {
      EXPECT_TRUE(stream.still_at(ms)) << ms;
    } else if (moves) {
      EXPECT_FALSE(stream.still_at(ms)) << ms;
    }
  }
}

TEST(StillDetector, SaysNothingOfMomentsThatItHasNoPosesOf) {
  Stream stream;
  EXPECT_FALSE(stream.still_at(0));
  stream.play(0, 500);
  EXPECT_TRUE(stream.still_at(460));
  EXPECT_FALSE(stream.still_at(520));  // what follows has not come in
  EXPECT_FALSE(stream.still_at(5000));
  stream.detector.push(DeviceTime{} + Duration::from_ms(4000), Stream::truth(0));
  EXPECT_FALSE(stream.still_at(460));  // long past
  EXPECT_FALSE(stream.still_at(4000));
}

TEST(StillDetector, AveragesAStretchAndItsScatter) {
  Stream stream;
  stream.play(0, 500);
  const auto rest = stream.detector.rest_between(DeviceTime{}, DeviceTime{} + Duration::from_ms(500));
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->samples, 51U);
  EXPECT_LT((rest->tracker_from_sensor.translation() - Stream::truth(0).translation()).norm(),
            3 * 0.3 / std::sqrt(51) * 1.8);
  EXPECT_LT(rotation_angle_between(rest->tracker_from_sensor.rotation(), Stream::truth(0).rotation()),
            0.1 * kRadPerDeg);
  EXPECT_NEAR(std::sqrt(rest->position_squares_mm2 / 51), 0.3, 0.06);
  EXPECT_NEAR(std::sqrt(rest->angle_squares_rad2 / 51), 0.1 * kRadPerDeg, 0.02 * kRadPerDeg);
  EXPECT_FALSE(stream.detector.rest_between(DeviceTime{}, DeviceTime{} + Duration::from_ms(20)));
}

TEST(StillDetector, PassesOverPosesThatAreNone) {
  Stream stream;
  stream.play(0, 200);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  stream.detector.push(DeviceTime{} + Duration::from_ms(205),
                       {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), {nan, 0, 0}});
  stream.play(210, 500);
  EXPECT_TRUE(stream.still_at(205));
  EXPECT_TRUE(stream.detector.rest_between(DeviceTime{}, DeviceTime{} + Duration::from_ms(500))
                  ->tracker_from_sensor.matrix()
                  .allFinite());
}

}  // namespace
}  // namespace birdseye::calibration
