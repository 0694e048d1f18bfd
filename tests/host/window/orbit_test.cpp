#include <gtest/gtest.h>

#include "host/window/orbit.hpp"
#include "tests/support/lens.hpp"

namespace birdseye::host {
namespace {

const Eigen::Vector3d kMiddle(20, -30, 40);

Transform<Camera, Patient> from_oblique() {
  const Eigen::Matrix3d r = rotation_exp(Eigen::Vector3d(0.4, 0.7, -0.2));
  return {r, Eigen::Vector3d(5, -3, 110) - r * kMiddle};
}

TEST(Orbit, KeepsThePointAndTakesWhatLiesBeforeItAlong) {
  const CameraModel lens = testing::wide_lens();
  const auto before = from_oblique();
  const Eigen::Vector3d in_camera = before * kMiddle;
  const Eigen::Vector3d front = before.inverse() * Eigen::Vector3d(in_camera - Eigen::Vector3d(0, 0, 20));
  for (const auto& [right_px, down_px] : {std::pair{30.0, 0.0}, {0.0, 30.0}, {-12.0, 25.0}}) {
    const auto after = orbited(lens, before, kMiddle, right_px, down_px);
    EXPECT_LT((after * kMiddle - in_camera).norm(), 1e-9);
    const Eigen::Vector3d moved = after * front - before * front;
    EXPECT_GE(moved.x() * right_px, -1e-9);
    EXPECT_GE(moved.y() * down_px, -1e-9);
    EXPECT_GT(moved.head<2>().dot(Eigen::Vector2d(right_px, down_px)), 0);
  }
  // Half a turn for the picture's width; and back again.
  const auto half = orbited(lens, before, kMiddle, lens.width_px, 0);
  EXPECT_LT((half.rotation() * before.rotation().transpose() - Eigen::Vector3d(-1, 1, -1).asDiagonal().toDenseMatrix())
                .norm(),
            1e-9);
  const auto back = orbited(lens, orbited(lens, before, kMiddle, 40, 0), kMiddle, -40, 0);
  EXPECT_LT((back.matrix() - before.matrix()).norm(), 1e-9);
}

TEST(Orbit, ComesNearerAlongTheLineOfSight) {
  const auto before = from_oblique();
  const Eigen::Vector3d in_camera = before * kMiddle;
  const auto nearer = approached(before, kMiddle, 2);
  EXPECT_LT((nearer * kMiddle - 0.81 * in_camera).norm(), 1e-9);
  EXPECT_EQ(nearer.rotation(), before.rotation());
  EXPECT_LT((approached(nearer, kMiddle, -2).matrix() - before.matrix()).norm(), 1e-9);
  EXPECT_NEAR((approached(before, kMiddle, 1000) * kMiddle).norm(), 10, 1e-9);
  EXPECT_NEAR((approached(before, kMiddle, -1000) * kMiddle).norm(), 10'000, 1e-6);
}

}  // namespace
}  // namespace birdseye::host
