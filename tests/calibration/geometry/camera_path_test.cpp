#include "calibration/geometry/camera_path.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace birdseye {
namespace {

using Pose = Transform<Camera, Patient>;

/// camera_from_patient of a camera at a place.
Pose at(const Eigen::Vector3d& centre_in_patient_mm, const Eigen::Vector3d& turn_rad) {
  const Eigen::Matrix3d r = rotation_exp(turn_rad);
  return {r, Eigen::Vector3d(-(r * centre_in_patient_mm))};
}

std::vector<Pose> keys() {
  return {at({0, 0, 100}, {0, 0, 0}), at({40, 10, 90}, {0, 0.5, 0}), at({60, -20, 40}, {0.3, 1.2, -0.2}),
          at({10, 5, -30}, {2.0, 1.0, 0.4})};
}

TEST(CameraPath, GoesThroughItsKeysAndNoFurther) {
  const auto k = keys();
  for (std::size_t i = 0; i < k.size(); ++i) {
    EXPECT_EQ(camera_along(k, static_cast<double>(i)).matrix(), k[i].matrix());
  }
  EXPECT_EQ(camera_along(k, -1).matrix(), k.front().matrix());
  EXPECT_EQ(camera_along(k, 99).matrix(), k.back().matrix());
  EXPECT_EQ(camera_along(std::vector<Pose>{k[2]}, 0.7).matrix(), k[2].matrix());
}

TEST(CameraPath, ItsCentreIsSmoothAndItsRotationEven) {
  const auto k = keys();
  constexpr double kStep = 1e-5;
  const auto centre = [&](double t) { return Eigen::Vector3d(camera_along(k, t).inverse().translation()); };
  for (const double key : {1.0, 2.0}) {
    const Eigen::Vector3d before = (centre(key) - centre(key - kStep)) / kStep;
    const Eigen::Vector3d after = (centre(key + kStep) - centre(key)) / kStep;
    EXPECT_LT((before - after).norm(), 1e-4 * before.norm());
    const auto i = static_cast<std::size_t>(key);
    const Eigen::Vector3d chord = 0.5 * (k[i + 1].inverse().translation() - k[i - 1].inverse().translation());
    EXPECT_LT((before - chord).norm(), 1e-3 * chord.norm());
  }
  for (std::size_t i = 0; i + 1 < k.size(); ++i) {
    const double whole = rotation_angle_between(k[i].rotation(), k[i + 1].rotation());
    for (const double u : {0.1, 0.5, 0.8}) {
      const Eigen::Matrix3d r = camera_along(k, static_cast<double>(i) + u).rotation();
      EXPECT_NEAR(rotation_angle_between(k[i].rotation(), r), u * whole, 1e-9);
      EXPECT_NEAR(rotation_angle_between(r, k[i + 1].rotation()), (1 - u) * whole, 1e-9);
    }
  }
}

TEST(CameraPath, TwoKeysGiveAStraightLineAtAConstantSpeed) {
  const auto all = keys();
  const std::vector<Pose> two{all[0], all[2]};
  for (const double u : {0.2, 0.5, 0.9}) {
    const Eigen::Vector3d c = camera_along(two, u).inverse().translation();
    EXPECT_LT((c - (Eigen::Vector3d(0, 0, 100) + u * Eigen::Vector3d(60, -20, -60))).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace birdseye
