// An operation that is taken up from an earlier window's folder: the scope's calibration, and a deformation that holds
// with it alone.
#include <gtest/gtest.h>

#include <cmath>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/points/point_error.hpp"
#include "host/operation/operation.hpp"
#include "tests/host/operation/live_workflow_fixture.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::calibrated_by;
using birdseye::testing::connect;
using birdseye::testing::give_record;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::load;
using birdseye::testing::looking_at;
using birdseye::testing::moved_to_the_left;
using birdseye::testing::operation_settings;
using birdseye::testing::registered_operation;
using birdseye::testing::resumed;
using birdseye::testing::Scratch;
using birdseye::testing::square;

TEST(LiveWorkflow, TargetAndLandmarksAreWhereTheDeformedCtHasThem) {
  const Scratch scratch;
  const LiveSettings again = resumed(scratch, scratch.path());
  Operation kept = registered_operation(again);
  kept.calibrated = calibrated_by(testing::straight_scope_record());
  kept.deformed = moved_to_the_left();
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  LiveWorkflow workflow(again);
  connect(workflow);
  load(workflow);
  ASSERT_EQ(workflow.view().fault, "");
  give_record(workflow);
  birdseye::testing::confirm(workflow, {4, 0, 0});
  EXPECT_NEAR(workflow.view().checked.value().off_mm, 0, 1e-3);
  ASSERT_TRUE(workflow.picture().setup().has_value());
  workflow.take(looking_at(workflow, {34, 30, 20}, 100, 0), HostTime{0}, ClockGap{});
  workflow.draw();
  const auto mark = workflow.view().target;
  ASSERT_TRUE(mark.has_value());
  const CameraModel& camera = workflow.picture().setup()->camera();
  EXPECT_LT((mark->at_px - Eigen::Vector2d(camera.cx_px, camera.cy_px)).norm(), 0.1);
  EXPECT_TRUE(mark->error.motion.has_value());
  EXPECT_NEAR(workflow.view().target_moved_mm.value_or(-1), 4, 1e-3);
  ASSERT_TRUE(workflow.view().expected.has_value());
  EXPECT_EQ(workflow.view().expected->motion->rms_mm, 0.7);
  const double fiducials_mm =
      calibration::TargetError(kFiducials, calibration::localisation_error_of(0.3, 4).upper95_mm).rms_mm({30, 30, 20});
  const double rigid_mm = std::sqrt((fiducials_mm * fiducials_mm + 1.5 * square(1.23 * 0.5)) * 5.99 / 3);
  EXPECT_NEAR(mark->error.radius95_mm(), std::hypot(rigid_mm, 1.2), 1e-3);
  Hand hand(workflow);
  hand.rest_at({34, 30, 21}, 30);
  const auto reading = workflow.view().check;
  ASSERT_TRUE(reading.has_value());
  EXPECT_EQ(reading->nearest, "tumour");
  EXPECT_NEAR(reading->distance_mm, 1, 0.1);
  // By another registration the deformation means nothing.
  workflow.go_to(LiveStep::fiducials);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(workflow.picture().setup().has_value()) << workflow.view().registration_fault;
  EXPECT_FALSE(workflow.view().deformed != nullptr);
  EXPECT_FALSE(workflow.view().note(LiveStep::deform).done);
}

/// A registration, and an organ that was deformed with the scope of the appliance's record.
void keep_deformed(const Scratch& scratch, const DeformedOrgan& organ) {
  Operation kept = registered_operation(resumed(scratch, scratch.path()));
  kept.calibrated = calibrated_by(birdseye::testing::straight_scope_record());
  kept.deformed = std::make_shared<const DeformedOrgan>(organ);
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
}

TEST(LiveWorkflow, ADeformationThatWasJudgedByAnotherTargetIsNotTakenUpAndNotLost) {
  const Scratch scratch;
  DeformedOrgan organ = *moved_to_the_left();
  organ.target_at_rest_mm = {80, 80, 80};
  keep_deformed(scratch, organ);
  {
    LiveWorkflow workflow(resumed(scratch, scratch.path()));
    connect(workflow);
    load(workflow);
    EXPECT_NE(workflow.view().fault.find("the target is another now"), std::string::npos) << workflow.view().fault;
    EXPECT_FALSE(workflow.view().deformed);
  }
  EXPECT_TRUE(read_operation(scratch.path())->deformed);
}

TEST(LiveWorkflow, ADeformationOfWhoseTargetNothingIsKnownIsNotTakenUp) {
  const Scratch scratch;
  DeformedOrgan organ = *moved_to_the_left();
  organ.target.reset();
  keep_deformed(scratch, organ);
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  connect(workflow);
  load(workflow);
  give_record(workflow);
  EXPECT_FALSE(workflow.view().deformed);
  EXPECT_NE(workflow.view().note(LiveStep::views).line.find("does not say how far"), std::string::npos)
      << workflow.view().note(LiveStep::views).line;
}

/// What a landmark shows with the deformation speaks against the registration without it, too.
TEST(LiveWorkflow, ALandmarkThatRefusedARegistrationStillDoesOnceTheDeformationIsUndone) {
  const Scratch scratch;
  keep_deformed(scratch, *moved_to_the_left());
  LiveWorkflow workflow(resumed(scratch, scratch.path()));
  connect(workflow);
  load(workflow);
  give_record(workflow);
  birdseye::testing::check_at(workflow, birdseye::testing::kTumour + Eigen::Vector3d(4, 0, 12));
  workflow.go_to(LiveStep::deform);
  workflow.undo();
  ASSERT_FALSE(workflow.view().deformed);
  workflow.go_to(LiveStep::check);
  birdseye::testing::check_at(workflow, kFiducials[0]);
  birdseye::testing::check_at(workflow, kFiducials[1]);
  EXPECT_FALSE(workflow.picture().setup().has_value());
  birdseye::testing::check_at(workflow, birdseye::testing::kTumour);
  EXPECT_TRUE(workflow.picture().setup().has_value()) << workflow.view().note(LiveStep::check).line;
}

/// Its strokes were of the tip that the registration was touched with.
TEST(LiveWorkflow, ADeformationIsTakenUpWithTheTipOfItsRegistrationAlone) {
  const Scratch scratch;
  const LiveSettings again = resumed(scratch, scratch.path());
  for (const double longer_mm : {0.0, 5.0}) {
    Operation kept = registered_operation(again);
    kept.calibrated = calibrated_by(birdseye::testing::straight_scope_record());
    kept.registered->tip_in_pointer_mm = *again.tip_in_pointer_mm + Eigen::Vector3d(0, 0, longer_mm);
    kept.deformed = moved_to_the_left();
    ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
    LiveWorkflow workflow(again);
    connect(workflow);
    load(workflow);
    give_record(workflow);
    EXPECT_EQ(workflow.view().deformed != nullptr, longer_mm == 0);
    if (longer_mm == 0) continue;
    EXPECT_EQ(workflow.view().note(LiveStep::views).line, "the pointer's tip is another: keep views again");
  }
}

/// The record is not adopted, and its tip is that of the pointer.
TEST(LiveWorkflow, ADeformationIsDroppedWithTheTipThoughTheBoardWasUsedLater) {
  const Scratch scratch;
  LiveSettings again = resumed(scratch, scratch.path());
  again.tip_in_pointer_mm.reset();
  auto record = birdseye::testing::straight_scope_record();
  Operation kept = registered_operation(again);
  kept.registered->tip_in_pointer_mm = record.tip->tip_in_sensor_mm;
  calibration::HandEyeResult found;
  found.held_out_px = 1;
  kept.calibrated = {ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, 0.3, found),
                     "2026-11-22T10:00:00Z",
                     true,
                     {birdseye::testing::kTracker, birdseye::testing::kCamera, 0}};
  kept.deformed = moved_to_the_left();
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  LiveWorkflow workflow(again);
  connect(workflow);
  load(workflow);
  give_record(workflow, record);
  EXPECT_TRUE(workflow.view().deformed);
  record.tip->tip_in_sensor_mm.z() += 5;
  give_record(workflow, record);
  EXPECT_FALSE(workflow.view().deformed);
}

/// Said at the start of the scope that is there: that the former window had another says nothing of it.
TEST(LiveWorkflow, TheRodsAngleStaysWhereTheFormerWindowHadAnotherScope) {
  const Scratch scratch;
  const auto record = birdseye::testing::example_record(768, 576, {}, {});
  calibration::HandEyeResult found;
  found.held_out_px = 1;
  const CalibratedScope by_board{ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, 0.3, found),
                                 "2026-11-22T09:00:00Z",
                                 true,
                                 {birdseye::testing::kTracker, birdseye::testing::kCamera, 0}};
  auto former = record;
  former.hand_eye->camera_from_sensor = Transform<Camera, Sensor>(Eigen::Matrix3d::Identity(), {0, 0, 250});
  for (const CalibratedScope& before : {by_board, calibrated_by(former)}) {
    for (const bool record_comes_first : {true, false}) {
      LiveSettings again = resumed(scratch, scratch.path());
      again.rod_angle_deg = 40;
      Operation kept = registered_operation(again);
      kept.calibrated = before;
      ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
      LiveWorkflow workflow(again);
      connect(workflow);
      if (record_comes_first) give_record(workflow, record);
      load(workflow);
      if (!record_comes_first) give_record(workflow, record);
      EXPECT_EQ(workflow.view().rod_angle_deg, 40) << before.by_board << record_comes_first;
    }
  }
}

/// The scope's calibration in an operation that was kept, and the appliance's record, made before or after it.
TEST(LiveWorkflow, OfTwoCalibrationsTheNewerCounts) {
  const Scratch scratch;
  for (const bool record_is_newer : {false, true}) {
    const LiveSettings again = resumed(scratch, scratch.path());
    Operation kept = registered_operation(again);
    calibration::HandEyeResult found;
    found.held_out_px = 1;
    // The record's is 09:30.
    kept.calibrated = {ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, 0.3, found),
                       record_is_newer ? "2026-11-22T09:00:00Z" : "2026-11-22T10:00:00Z",
                       true,
                       {birdseye::testing::kTracker, birdseye::testing::kCamera, 0}};
    ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
    LiveWorkflow workflow(again);
    connect(workflow);
    load(workflow);
    ASSERT_EQ(workflow.view().fault, "");
    give_record(workflow);
    birdseye::testing::confirm(workflow);
    ASSERT_TRUE(workflow.picture().setup().has_value());
    EXPECT_EQ(workflow.picture().setup()->camera().fx_px == 500, !record_is_newer);
  }
}

/// Found by a record that the appliance sent: whether it sends the same again decides.
TEST(LiveWorkflow, ADeformationIsTakenUpWithTheCalibrationItWasFoundByAlone) {
  const Scratch scratch;
  const auto record = birdseye::testing::example_record(768, 576, {}, {});
  auto other = record;
  other.hand_eye->camera_from_sensor = Transform<Camera, Sensor>(Eigen::Matrix3d::Identity(), {0, 0, 250});
  Operation kept = registered_operation(operation_settings(scratch));
  kept.calibrated = calibrated_by(record);
  kept.deformed = moved_to_the_left();
  for (const bool same : {true, false}) {
    for (const bool record_comes_first : {true, false}) {
      ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
      LiveWorkflow workflow(resumed(scratch, scratch.path()));
      connect(workflow);
      if (record_comes_first) give_record(workflow, same ? record : other);
      load(workflow);
      ASSERT_EQ(workflow.view().fault, "");
      if (!record_comes_first) give_record(workflow, same ? record : other);
      EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done);
      EXPECT_EQ(workflow.view().deformed != nullptr, same) << record_comes_first;
    }
  }
}

/// A window in between had no record yet when it wrote what it had taken up; or it had another scope's.
TEST(LiveWorkflow, ADeformationStaysWithItsCalibrationThroughSeveralWindows) {
  const Scratch scratch;
  const auto record = birdseye::testing::example_record(768, 576, {}, {});
  auto other = record;
  other.hand_eye->camera_from_sensor = Transform<Camera, Sensor>(Eigen::Matrix3d::Identity(), {0, 0, 250});
  Operation kept = registered_operation(operation_settings(scratch));
  kept.calibrated = calibrated_by(record);
  kept.deformed = moved_to_the_left();
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  const auto deformed_with = [&](const calibration::CalibrationRecord* given) {
    LiveSettings settings = resumed(scratch, scratch.path());
    settings.out = scratch.path();
    LiveWorkflow workflow(settings);
    connect(workflow);
    load(workflow);
    EXPECT_EQ(workflow.view().fault, "");
    if (given != nullptr) give_record(workflow, *given);
    return workflow.view().deformed != nullptr;
  };
  (void)deformed_with(nullptr);
  EXPECT_TRUE(deformed_with(&record));
  (void)deformed_with(nullptr);
  EXPECT_FALSE(deformed_with(&other));
  EXPECT_FALSE(deformed_with(&record)) << "it was forgotten for good";
  // Nobody knows of which scope it is.
  kept.calibrated.reset();
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  EXPECT_FALSE(deformed_with(&record));
}

}  // namespace
}  // namespace birdseye::host
