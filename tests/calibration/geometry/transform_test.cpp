#include "calibration/geometry/transform.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "calibration/geometry/rigid_matrix.hpp"

namespace birdseye {
namespace {

Eigen::Vector3d random_vector(std::mt19937& rng, double scale) {
  std::uniform_real_distribution<double> u(-scale, scale);
  return {u(rng), u(rng), u(rng)};
}

TEST(RigidMatrix, IsARightHandedRotationAndAPlaceThatPicturesCanBeDrawnFrom) {
  std::mt19937 rng(2);
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotation_exp(random_vector(rng, 2));
  m.topRightCorner<3, 1>() << 0, -1e5, 3;
  EXPECT_TRUE(is_rigid(m, 1e-6));
  Eigen::Matrix4d mirrored = m, scaled = m, beyond = m, nothing = m;
  mirrored.col(0) *= -1;
  scaled.topLeftCorner<3, 3>() *= 1.001;
  beyond(1, 3) = -1.001e5;
  nothing(2, 3) = std::nan("");
  for (const Eigen::Matrix4d& no : {mirrored, scaled, beyond, nothing}) EXPECT_FALSE(is_rigid(no, 1e-6)) << no;
  EXPECT_TRUE(is_rigid(scaled, 1e-2));
}

TEST(Transform, InverseUndoesAndChainAssociates) {
  std::mt19937 rng(1);
  for (int i = 0; i < 200; ++i) {
    const Transform<Camera, Sensor> camera_from_sensor(rotation_exp(random_vector(rng, 2)), random_vector(rng, 300));
    const Transform<Sensor, Tracker> sensor_from_tracker(rotation_exp(random_vector(rng, 2)), random_vector(rng, 300));
    const Eigen::Vector3d p_mm = random_vector(rng, 500);
    const Transform<Camera, Tracker> chain = camera_from_sensor * sensor_from_tracker;
    EXPECT_LT((chain * p_mm - camera_from_sensor * (sensor_from_tracker * p_mm)).norm(), 1e-9);
    EXPECT_LT((chain.inverse() * (chain * p_mm) - p_mm).norm(), 1e-9);
  }
}

TEST(Rotation, LogUndoesExpFromTinyAnglesToNearlyPi) {
  std::mt19937 rng(2);
  for (const double angle : {0.0, 1e-12, 1e-6, 0.1, 1.0, 3.0, std::numbers::pi - 1e-7}) {
    const Eigen::Vector3d v = random_vector(rng, 1).normalized() * angle;
    EXPECT_LT((rotation_log(rotation_exp(v)) - v).norm(), 1e-8) << angle;
  }
}

TEST(Rotation, AngleBetweenIsSymmetric) {
  std::mt19937 rng(3);
  const Eigen::Matrix3d a = rotation_exp(random_vector(rng, 1));
  const Eigen::Matrix3d b = a * rotation_exp(Eigen::Vector3d(0, 0.25, 0));
  EXPECT_NEAR(rotation_angle_between(a, b), 0.25, 1e-12);
  EXPECT_NEAR(rotation_angle_between(b, a), 0.25, 1e-12);
}

}  // namespace
}  // namespace birdseye
