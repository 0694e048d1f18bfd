#include "host/overlay/scope_setup.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/files/camera_files.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::example_record;
using birdseye::testing::Scratch;

TEST(ScopeSetup, OfARecordTellsTheHeldOutErrorAndNotTheFits) {
  auto record = example_record(768, 576, {}, {});
  const auto scope = ScopeSetup::of_record(record);
  ASSERT_TRUE(scope.has_value());
  EXPECT_EQ(scope->camera().fx_px, record.lens->camera.fx_px);
  EXPECT_EQ(scope->figures().camera_rms_px, 0.21);
  EXPECT_EQ(scope->figures().held_out_px, 1.75);
  EXPECT_EQ(scope->figures().held_out_mm, 0.5);
  EXPECT_EQ(scope->figures().hand_eye_stations, 14);
  const auto in_part = ScopeSetup::of_record(record, {0.4, 3, std::nullopt});
  EXPECT_EQ(in_part->figures().held_out_px, 3);
  EXPECT_EQ(in_part->figures().hand_eye_stations, 14);
  EXPECT_FALSE(ScopeSetup::of_record(record, {0.4, 3, 0.7})->figures().hand_eye_stations)
      << "nobody says what the stated error rests on";
  EXPECT_EQ(scope->camera_covariance(), record.lens->covariance);
  record.lens->covariance.setZero();
  EXPECT_FALSE(ScopeSetup::of_record(record)->camera_covariance().has_value()) << "nobody has stated it";
  record.hand_eye.reset();
  EXPECT_FALSE(ScopeSetup::of_record(record).has_value());
}

TEST(ScopeSetup, OfARodIsWhereItIsTurnedTo) {
  const auto record = example_record(768, 576, {}, {});
  const auto scope = ScopeSetup::of_record(record);
  ASSERT_TRUE(scope.has_value());
  EXPECT_TRUE(scope->has_rod());
  EXPECT_TRUE(scope->figures().rod_angle_missing) << "nobody has said it";
  const ScopeSetup as_calibrated = scope->turned_to(30);
  EXPECT_FALSE(as_calibrated.figures().rod_angle_missing);
  EXPECT_TRUE(
      as_calibrated.camera_from_sensor().matrix().isApprox(record.hand_eye->camera_from_sensor.matrix(), 1e-12));
  // Points of the rod's axis stay where they are in the picture, but that this turns about its middle.
  const ScopeSetup turned = scope->turned_to(75);
  const auto& rod = *record.hand_eye->rod;
  const Eigen::Vector3d before = as_calibrated.camera_from_sensor() * rod.axis_point_in_sensor_mm;
  const Eigen::Vector3d after = turned.camera_from_sensor() * rod.axis_point_in_sensor_mm;
  EXPECT_LT((Eigen::AngleAxisd(45 * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()) * before - after).norm(), 1e-9);
  EXPECT_GT((turned.camera_from_sensor().translation() - as_calibrated.camera_from_sensor().translation()).norm(), 1);
}

/// The error of a place before the camera is that of the solver's own covariance, drawn at random.
TEST(ScopeSetup, TheCovarianceOfHandEyeIsToldAboutTheCamera) {
  calibration::HandEyeResult found;
  found.camera_from_sensor = Transform<Camera, Sensor>(Eigen::Matrix3d::Identity(), {6, -14, -300});
  const Eigen::Matrix<double, 6, 1> sigma =
      (Eigen::Matrix<double, 6, 1>() << 1e-3, 2e-3, 1e-3, 0.3, 0.2, 0.5).finished();
  found.covariance = sigma * sigma.transpose();  // one error, of which all six are multiples
  const ScopeSetup scope = ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, std::nullopt, found);
  const Eigen::Vector3d place_mm(10, -5, 120), in_sensor_mm = place_mm - found.camera_from_sensor.translation();
  const Eigen::Vector3d w = sigma.head<3>();
  const Eigen::Vector3d error_mm = w.cross(in_sensor_mm) + sigma.tail<3>();  // to the first order
  Eigen::Matrix<double, 3, 6> by;
  by << 0, place_mm.z(), -place_mm.y(), 1, 0, 0, -place_mm.z(), 0, place_mm.x(), 0, 1, 0, place_mm.y(), -place_mm.x(),
      0, 0, 0, 1;
  const Eigen::Matrix3d told = by * *scope.figures().hand_eye_covariance * by.transpose();
  EXPECT_TRUE(told.isApprox(error_mm * error_mm.transpose(), 1e-9)) << told;
}

TEST(ScopeSetup, CalibratedAtOneAngleOfTheRodHoldsAtThatOne) {
  auto record = example_record(768, 576, {}, {});
  record.hand_eye->rod.reset();  // nobody measured how it turns
  const auto scope = ScopeSetup::of_record(record);
  ASSERT_TRUE(scope.has_value());
  EXPECT_TRUE(scope->figures().rod_angle_missing);
  EXPECT_FALSE(scope->turned_to(31).figures().rod_angle_missing);
  EXPECT_FALSE(scope->turned_to(390).figures().rod_angle_missing);
  EXPECT_TRUE(scope->turned_to(40).figures().rod_angle_missing);
  record.lens->rod_angle_deg.reset();
  EXPECT_FALSE(ScopeSetup::of_record(record)->has_rod());
  EXPECT_FALSE(ScopeSetup::of_record(record)->figures().rod_angle_missing);
}

/// Found from poses that another program gave, without pictures: no corner was off by anything.
TEST(ScopeSetup, AHandEyeWithoutPicturesHasNoFigureInPixels) {
  calibration::HandEyeResult found;
  found.held_out_mm = 0.7;
  found.independent_stations = 12;
  const ScopeSetup scope = ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, std::nullopt, found);
  EXPECT_FALSE(scope.figures().held_out_px.has_value());
  EXPECT_FALSE(scope.figures().camera_rms_px.has_value());
  EXPECT_EQ(scope.figures().held_out_mm, 0.7);
  EXPECT_EQ(scope.figures().hand_eye_stations, 12);
}

TEST(ScopeSetup, OfFilesKnowsWhatIsStatedAndNamesWhatIsMissing) {
  const Scratch scratch;
  const std::string pose = scratch.file("hand_eye.txt", "1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  const std::string camera = scratch.file(
      "camera.yaml",
      "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   "
      "dt: d\n   data: [ 60., 0., 32., 0., 60., 24., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: "
      "1\n   cols: 5\n   dt: d\n   data: [ -0.1, 0., 0., 0., 0. ]\n");
  const auto scope = ScopeSetup::of_files(camera, pose, {0.3, std::nullopt, std::nullopt});
  ASSERT_TRUE(scope) << scope.error().what;
  EXPECT_EQ(scope->figures().camera_rms_px, 0.3);
  EXPECT_FALSE(scope->figures().held_out_px.has_value());
  EXPECT_EQ(scope->camera_from_sensor().translation().x(), 5);
  EXPECT_FALSE(scope->camera_covariance().has_value());
  CameraMatrix covariance = CameraMatrix::Identity();
  covariance(0, 1) = covariance(1, 0) = 0.25;
  const auto known = ScopeSetup::of_files(
      scratch.file("known.yaml", camera_text(scope->camera()) + camera_covariance_text(covariance)), pose, {});
  ASSERT_TRUE(known) << known.error().what;
  ASSERT_TRUE(known->camera_covariance().has_value());
  EXPECT_LT((*known->camera_covariance() - covariance).norm(), 1e-9);
  const auto none = ScopeSetup::of_files(camera, scratch / "nothere.txt", {});
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("nothere.txt"), std::string::npos);
}

/// A point seen where the tracker, hand-eye and registration put it, by hand.
TEST(ScopeSetup, RegisteredGivesWhereTheCtLiesBeforeTheCamera) {
  calibration::HandEyeResult found;
  found.camera_from_sensor = Transform<Camera, Sensor>(Eigen::Matrix3d::Identity(), {0, 0, 10});
  const auto setup = ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, 0.3, found)
                         .registered(Transform<Tracker, Patient>(Eigen::Matrix3d::Identity(), {100, 0, 0}));
  const Transform<Tracker, Sensor> tracker_from_sensor(Eigen::Matrix3d::Identity(), {90, 0, -50});
  const Eigen::Vector3d in_camera_mm = setup.camera_from_patient(tracker_from_sensor) * Eigen::Vector3d(1, 2, 3);
  EXPECT_LT((in_camera_mm - Eigen::Vector3d(11, 2, 63)).norm(), 1e-12);
}

}  // namespace
}  // namespace birdseye::host
