#include "host/overlay/scope_setup.hpp"

#include <gtest/gtest.h>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/files/camera_covariance.hpp"
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
  EXPECT_EQ(ScopeSetup::of_record(record, {0.4, 3, std::nullopt})->figures().held_out_px, 3);
  EXPECT_EQ(scope->camera_covariance(), record.lens->covariance);
  record.lens->covariance.setZero();
  EXPECT_FALSE(ScopeSetup::of_record(record)->camera_covariance().has_value()) << "nobody has stated it";
  record.hand_eye.reset();
  EXPECT_FALSE(ScopeSetup::of_record(record).has_value());
}

/// Found from poses that another program gave, without pictures: no corner was off by anything.
TEST(ScopeSetup, AHandEyeWithoutPicturesHasNoFigureInPixels) {
  calibration::HandEyeResult found;
  found.held_out_mm = 0.7;
  const ScopeSetup scope = ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, std::nullopt, found);
  EXPECT_FALSE(scope.figures().held_out_px.has_value());
  EXPECT_FALSE(scope.figures().camera_rms_px.has_value());
  EXPECT_EQ(scope.figures().held_out_mm, 0.7);
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
