#include "hw-sim/case/pose_error.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "hw-sim/case/placed_instruments.hpp"

namespace birdseye::hw_sim {
namespace {

using Eigen::Vector3d;

std::vector<Transform<Camera, Patient>> some_views(int count) {
  std::vector<Transform<Camera, Patient>> views;
  for (int i = 0; i < count; ++i)
    views.emplace_back(rotation_exp(Vector3d(0.1 * i, 0.5, -0.2)), Vector3d(3 * i, -20, 150));
  return views;
}

/// What was done to a pose, in the frame of a sensor 280 mm behind the lens whose axes are the camera's.
Transform<Sensor, Sensor> error_at_sensor(const Transform<Camera, Patient>& stated,
                                          const Transform<Camera, Patient>& truth) {
  const Transform<Sensor, Camera> sensor_from_camera(Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Vector3d(0, 0, 280));
  return sensor_from_camera * stated * truth.inverse() * sensor_from_camera.inverse();
}

TEST(PoseError, OfNoiseIsAsLargeAsAskedPerAxisAndItsOwnInEachView) {
  const auto truth = some_views(2000);
  const auto stated = tracked_poses(truth, {.noise_mm = 1.5, .noise_deg = 0.4}, 3);
  Vector3d shift2 = Vector3d::Zero(), turn2 = Vector3d::Zero(), shift = Vector3d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const auto error = error_at_sensor(stated[i], truth[i]);
    shift += error.translation();
    shift2 += error.translation().cwiseAbs2();
    turn2 += rotation_log(error.rotation()).cwiseAbs2() / (kRadPerDeg * kRadPerDeg);
  }
  const auto n = static_cast<double>(truth.size());
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(shift2[axis] / n), 1.5, 0.1);
    EXPECT_NEAR(std::sqrt(turn2[axis] / n), 0.4, 0.03);
    EXPECT_NEAR(shift[axis] / n, 0, 0.15);
  }
}

TEST(PoseError, OfHandEyeIsOneForAllViews) {
  const auto truth = some_views(4);
  const auto stated = tracked_poses(truth, {.offset_mm = 2, .offset_deg = 0.7}, 3);
  const auto first = error_at_sensor(stated[0], truth[0]);
  EXPECT_NEAR(first.translation().norm(), 2, 1e-9);
  EXPECT_NEAR(rotation_log(first.rotation()).norm(), 0.7 * kRadPerDeg, 1e-9);
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const auto other = error_at_sensor(stated[i], truth[i]);
    EXPECT_LT((other.matrix() - first.matrix()).norm(), 1e-9);
  }
}

TEST(PlacedInstruments, EndJustAboveTheOrganAndDoNotRunThroughIt) {
  const Mesh organ = closed_surface([](const Vector3d& p) { return p.norm() - 60; }, {-70, -70, -70}, {70, 70, 70}, 3);
  for (int count = 1; count <= 3; ++count) {
    const auto placed = place_instruments(organ, Vector3d::UnitX(), count, 5);
    ASSERT_TRUE(placed);
    double nearest_mm = 1e9;
    double furthest_mm = 0;
    for (const Eigen::Vector3f& v : placed->vertices) {
      nearest_mm = std::min<double>(nearest_mm, v.norm() - 60);
      furthest_mm = std::max<double>(furthest_mm, v.norm());
    }
    EXPECT_GT(nearest_mm, 0.5);
    EXPECT_LT(nearest_mm, 12);
    EXPECT_GT(furthest_mm, 200);
    EXPECT_EQ(placed->vertices.size() % static_cast<std::size_t>(count), 0U);
  }
  // Its back is turned: there is no surface that faces the scope.
  Mesh turned = organ;
  for (Eigen::Vector3f& normal : turned.normals) normal = -normal;
  const auto refused = place_instruments(turned, Vector3d::UnitX(), 1, 5);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("--instruments 1"), std::string::npos);
}

}  // namespace
}  // namespace birdseye::hw_sim
