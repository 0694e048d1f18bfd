// An oblique scope's rod: model, inverse and fit.
#include <gtest/gtest.h>

#include <random>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rod.hpp"
#include "calibration/hand_eye/rod_fit.hpp"

namespace birdseye {
namespace {

using calibration::fit_rod;
using calibration::RodStation;

/// A 30 degree scope: the rod runs along the sensor's z, 12 mm beside it; the camera looks 30 degrees off the rod, 300
/// mm down. Straight: along the rod.
RodScope scope_of(double oblique_deg) {
  RodScope scope;
  scope.axis_in_sensor = Eigen::Vector3d(0.02, -0.01, 1).normalized();
  scope.axis_point_in_sensor_mm = Eigen::Vector3d(12, -3, 0);
  const Eigen::Quaterniond onto = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(0, 0, 1), scope.axis_in_sensor);
  const Eigen::Matrix3d sensor_from_camera = onto.toRotationMatrix() * rotation_exp({oblique_deg * kRadPerDeg, 0, 0});
  const Transform<Sensor, Camera> pose(sensor_from_camera,
                                       Eigen::Vector3d(scope.axis_point_in_sensor_mm + 300 * scope.axis_in_sensor));
  scope.camera_from_sensor_at_zero = pose.inverse();
  return scope;
}

template <typename To, typename From>
void expect_same(const Transform<To, From>& a, const Transform<To, From>& b, double within = 1e-9) {
  EXPECT_LT((a.matrix() - b.matrix()).cwiseAbs().maxCoeff(), within);
}

TEST(Rod, TurningAStraightScopeChangesNothing) {
  const RodScope straight = scope_of(0);
  for (const double deg : {-90.0, 20.0, 180.0})
    expect_same(straight.camera_from_sensor(deg * kRadPerDeg), straight.camera_from_sensor_at_zero);
}

TEST(Rod, AnObliqueScopeLooksRoundTheRodAndItsPictureStaysUpright) {
  const RodScope scope = scope_of(30);
  const auto zero = scope.camera_from_sensor(0).inverse();
  const auto half = scope.camera_from_sensor(180 * kRadPerDeg).inverse();
  // It looks 30 degrees to the one side of the rod, then to the other: 60 between.
  EXPECT_NEAR(std::acos(zero.rotation().col(2).dot(half.rotation().col(2))) * kDegPerRad, 60, 1e-9);
  EXPECT_NEAR(zero.rotation().col(2).dot(scope.axis_in_sensor), std::cos(30 * kRadPerDeg), 1e-12);
  // The chip stays: up in the picture is up in the head, but for the tilt.
  EXPECT_NEAR(zero.rotation().col(0).dot(half.rotation().col(0)), 1, 1e-9);
  expect_same(zero, scope.camera_from_sensor(360 * kRadPerDeg).inverse());
}

TEST(Rod, ItsInverseBringsItBack) {
  const RodScope scope = scope_of(30);
  for (const double deg : {-75.0, 10.0, 140.0}) {
    const double theta = deg * kRadPerDeg;
    expect_same(at_zero(scope, scope.camera_from_sensor(theta), theta), scope.camera_from_sensor_at_zero);
  }
}

TEST(RodFit, ExactStationsGiveTheRodBack) {
  for (const double picture_turn : {1.0, 0.0, -1.0}) {
    RodScope truth = scope_of(30);
    truth.picture_turn = picture_turn;
    std::vector<RodStation> stations;
    for (const double deg : {0.0, 60.0})
      stations.push_back({deg * kRadPerDeg, truth.camera_from_sensor(deg * kRadPerDeg)});
    const auto fit = fit_rod(stations);
    ASSERT_TRUE(fit);
    EXPECT_EQ(fit->scope.picture_turn, picture_turn);
    EXPECT_LT((fit->scope.axis_in_sensor - truth.axis_in_sensor).norm(), 1e-9);
    for (const double deg : {-120.0, 33.0, 170.0})
      expect_same(fit->scope.camera_from_sensor(deg * kRadPerDeg), truth.camera_from_sensor(deg * kRadPerDeg), 1e-6);
  }
}

TEST(RodFit, NoisyStationsGiveItAsWellAsTheyAre) {
  const RodScope truth = scope_of(30);
  std::mt19937 rng(2);
  std::normal_distribution<double> normal(0, 1);
  const auto normal3 = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
  constexpr double kTurn_deg = 0.1, kShift_mm = 0.3;
  std::vector<RodStation> stations;
  for (const double deg : {-135.0, -90.0, -45.0, 0.0, 45.0, 90.0, 135.0, 180.0}) {
    const auto exact = truth.camera_from_sensor(deg * kRadPerDeg);
    const Transform<Camera, Camera> off(rotation_exp(kTurn_deg * kRadPerDeg * normal3()), kShift_mm * normal3());
    stations.push_back({deg * kRadPerDeg, off * exact});
  }
  const auto fit = fit_rod(stations);
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->scope.picture_turn, 1);
  EXPECT_LT(std::acos(fit->scope.axis_in_sensor.dot(truth.axis_in_sensor)) * kDegPerRad, 0.15);
  // At an angle that was no station's, the camera is where it should be to about one station's own error.
  const auto found = fit->scope.camera_from_sensor(20 * kRadPerDeg), exact = truth.camera_from_sensor(20 * kRadPerDeg);
  EXPECT_LT(rotation_angle_between(found.rotation(), exact.rotation()) * kDegPerRad, 0.2);
  EXPECT_LT((found.inverse().translation() - exact.inverse().translation()).norm(), 0.8);
  EXPECT_GT(fit->turn_rms_deg, 0.02);
  EXPECT_LT(fit->turn_rms_deg, 0.3);
}

TEST(RodFit, RefusesWhatDoesNotTellTheAxis) {
  const RodScope truth = scope_of(30);
  EXPECT_EQ(fit_rod({}).error().code, Errc::degenerate);
  const std::vector<RodStation> near{{0, truth.camera_from_sensor(0)}, {0.1, truth.camera_from_sensor(0.1)}};
  EXPECT_EQ(fit_rod(near).error().code, Errc::degenerate);
  const std::vector<RodStation> nan{{0, truth.camera_from_sensor(0)}, {NAN, truth.camera_from_sensor(1)}};
  EXPECT_EQ(fit_rod(nan).error().code, Errc::bad_value);
}

}  // namespace
}  // namespace birdseye
