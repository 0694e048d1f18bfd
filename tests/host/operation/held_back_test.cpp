// What was found with instruments that are not connected any more: nothing is drawn by it, and it comes back with them.
#include <gtest/gtest.h>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/operation/instruments.hpp"
#include "host/operation/operation.hpp"
#include "tests/support/live_operation.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect;
using birdseye::testing::connect_and_calibrate;
using birdseye::testing::example_record;
using birdseye::testing::give_record;
using birdseye::testing::Hand;
using birdseye::testing::kCamera;
using birdseye::testing::kFiducials;
using birdseye::testing::kMs;
using birdseye::testing::kTracker;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::load;
using birdseye::testing::looking_at;
using birdseye::testing::operation_settings;
using birdseye::testing::Scratch;
using birdseye::testing::tell_health;

const calibration::Identity kOtherTracker{{"model", "miniBIRD 800"}, {"unit_serial", "4712"}};
const calibration::Identity kOtherCamera{{"card", "Storz"}, {"serial", "B2"}};

TEST(ConnectedInstruments, AreTheSameOnlyWhereTheySaySo) {
  ConnectedInstruments connected;
  const Instruments kept{kTracker, kCamera, 0};
  EXPECT_FALSE(connected.match(kept, DependsOn::tracker).holds) << "nothing is connected";
  EXPECT_FALSE(connected.match(kept, DependsOn::tracker).person_may_say);
  connected.set_link(true);
  InstrumentMatch match = connected.match(kept, DependsOn::tracker_and_camera);
  EXPECT_FALSE(match.holds);
  EXPECT_TRUE(match.person_may_say) << match.why_not;
  wire::Health health;
  health.instruments = {{"tracker", "running", "", 0, kTracker}, {"camera", "running", "", 0, kOtherCamera}};
  connected.take(health);
  EXPECT_TRUE(connected.match(kept, DependsOn::tracker).holds);
  match = connected.match(kept, DependsOn::tracker_and_camera);
  EXPECT_FALSE(match.holds);
  EXPECT_FALSE(match.person_may_say);
  EXPECT_NE(match.why_not.find("A1"), std::string::npos) << match.why_not;
  EXPECT_NE(match.why_not.find("B2"), std::string::npos) << match.why_not;
  connected.vouch();
  EXPECT_FALSE(connected.match(kept, DependsOn::tracker_and_camera).holds) << "a person does not overrule a camera";
}

TEST(ConnectedInstruments, WhatNobodyTellsAPersonMaySayOncePerConnection) {
  ConnectedInstruments connected;
  connected.set_link(true);
  const Instruments here = connected.now();
  EXPECT_TRUE(connected.match(here, DependsOn::tracker_and_camera).holds) << "found by this very connection";
  connected.set_link(false);
  connected.set_link(true);
  EXPECT_TRUE(connected.match(here, DependsOn::tracker_and_camera).person_may_say);
  connected.vouch();
  EXPECT_TRUE(connected.match(here, DependsOn::tracker_and_camera).holds);
  connected.set_link(false);
  connected.set_link(true);
  EXPECT_FALSE(connected.match(here, DependsOn::tracker_and_camera).holds);
  // A camera that is another, and a tracker of which nothing is told: a person's word is not asked for.
  wire::Health health;
  health.instruments = {{"camera", "running", "", 0, kOtherCamera}};
  connected.take(health);
  EXPECT_FALSE(connected.match({kTracker, kCamera, 0}, DependsOn::tracker_and_camera).person_may_say);
}

/// A patient that is registered, before a running overlay.
class HeldBack : public ::testing::Test {
 protected:
  void SetUp() override {
    load(workflow_);
    connect_and_calibrate(workflow_);
    for (const Eigen::Vector3d& fiducial : kFiducials) hand_.rest_at(fiducial, 80);
    hand_.rest_at({0, 0, 200}, 1);
    workflow_.go_to(LiveStep::run);
    show_frame();
    ASSERT_TRUE(overlaid()) << reason();
  }
  /// The patient's middle, a moment after the frame before.
  void show_frame(std::int64_t later_ms = 33) {
    time_ms_ += later_ms;
    if (workflow_.picture().setup()) pose_ = looking_at(workflow_, {30, 30, 20}, 100, 0.1);
    pose_.info.acquired = DeviceTime{time_ms_ * kMs};
    workflow_.take(pose_, HostTime{time_ms_ * kMs}, ClockGap{{}, {HostTime{0}, {}}});
    workflow_.draw();
  }
  bool overlaid() { return workflow_.shown_at(HostTime{time_ms_ * kMs}).overlaid; }
  std::string reason() { return workflow_.shown_at(HostTime{time_ms_ * kMs}).reason; }
  void withdraw_record(const std::string& why) {
    workflow_.take(wire::Calibration{false, why, ""}, HostTime{time_ms_ * kMs}, std::nullopt);
  }

  const Scratch scratch_;
  LiveWorkflow workflow_{operation_settings(scratch_)};
  Hand hand_{workflow_};
  wire::VideoFrame pose_;
  std::int64_t time_ms_ = 100;
};

TEST_F(HeldBack, AWithdrawnRecordTakesTheOverlayAwayAtOnceAndTheSameBringsItBack) {
  withdraw_record("the camera is another");
  EXPECT_FALSE(overlaid()) << "before the next frame comes";
  EXPECT_NE(reason().find("the camera is another"), std::string::npos) << reason();
  EXPECT_FALSE(workflow_.view().note(LiveStep::calibrate).done);
  EXPECT_EQ(workflow_.view().step, LiveStep::calibrate) << "the step is open again";
  EXPECT_TRUE(workflow_.view().note(LiveStep::fiducials).done) << "the touches are in the tracker's frame";
  show_frame();
  EXPECT_FALSE(overlaid());
  give_record(workflow_);
  show_frame();
  EXPECT_TRUE(overlaid()) << reason();
  EXPECT_EQ(workflow_.view().step, LiveStep::run);
  EXPECT_TRUE(workflow_.view().note(LiveStep::calibrate).done);
}

TEST_F(HeldBack, ThePointersTipGoesWithTheRecord) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.tip_in_pointer_mm.reset();
  LiveWorkflow workflow(settings);
  load(workflow);
  auto record = example_record(768, 576, {}, {});
  record.tip.emplace();
  record.tip->provenance = record.hand_eye->provenance;
  record.tip->tip_in_sensor_mm = {0, 0, 150};
  record.tip->covariance_mm2 = Eigen::Matrix3d::Identity() * 0.01;
  record.tip->rms_mm = 0.3;
  connect(workflow);
  give_record(workflow, record);
  workflow.go_to(LiveStep::fiducials);
  Hand hand(workflow);
  hand.rest_at(kFiducials[0], 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().touches.size(), 1U);
  workflow.take(wire::Calibration{false, "the tracker is another", ""}, HostTime{0}, std::nullopt);
  hand.rest_at(kFiducials[1], 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_EQ(workflow.view().touches.size(), 1U) << "by no tip that is known";
}

TEST_F(HeldBack, ADamagedRecordIsNoneAtAll) {
  workflow_.take(wire::Calibration{true, "", "{\"cut"}, HostTime{0}, std::nullopt);
  EXPECT_FALSE(overlaid());
  EXPECT_FALSE(workflow_.picture().setup().has_value());
}

TEST_F(HeldBack, AnotherTrackerTakesTheRegistrationAwayAndItsReturnBringsItBack) {
  tell_health(workflow_, kOtherTracker);
  EXPECT_FALSE(overlaid());
  EXPECT_NE(reason().find("4712"), std::string::npos) << reason();
  EXPECT_FALSE(workflow_.view().note(LiveStep::fiducials).done);
  EXPECT_FALSE(workflow_.view().fre_mm.has_value());
  EXPECT_EQ(workflow_.view().step, LiveStep::fiducials);
  tell_health(workflow_);
  show_frame();
  EXPECT_TRUE(overlaid()) << reason();
  EXPECT_EQ(workflow_.view().step, LiveStep::run);
}

TEST_F(HeldBack, WhatIsTouchedWithAnotherTrackerBeginsAnew) {
  tell_health(workflow_, kOtherTracker);
  hand_.rest_at(kFiducials[0], 80);
  hand_.rest_at({0, 0, 200}, 1);
  EXPECT_EQ(workflow_.view().touches.size(), 1U);
  EXPECT_FALSE(workflow_.picture().setup().has_value());
  tell_health(workflow_);
  EXPECT_FALSE(workflow_.picture().setup().has_value()) << "one touch, of a tracker that has gone again";
}

TEST_F(HeldBack, AfterALostLinkTheApplianceHasToSendItsRecordAgain) {
  workflow_.set_link(false, "gone");
  EXPECT_FALSE(overlaid());
  EXPECT_EQ(workflow_.view().step, LiveStep::connect);
  workflow_.set_link(true, "connected");
  tell_health(workflow_);
  workflow_.set_link(true, "connected");
  show_frame();
  EXPECT_FALSE(overlaid()) << "a cart without a record";
  EXPECT_EQ(workflow_.view().step, LiveStep::calibrate);
  give_record(workflow_);
  show_frame();
  EXPECT_TRUE(overlaid()) << reason();
  EXPECT_EQ(workflow_.view().step, LiveStep::run);
}

TEST_F(HeldBack, AServerThatTellsOfNoInstrumentIsAskedAboutAtAReconnection) {
  workflow_.set_link(false, "gone");
  workflow_.set_link(true, "connected");
  show_frame();
  workflow_.set_link(true, "connected");
  give_record(workflow_);
  show_frame();
  EXPECT_FALSE(overlaid()) << "the registration is of a tracker of which nothing is told now";
  EXPECT_TRUE(workflow_.view().asks_for_instruments);
  workflow_.primary(HostTime{0});
  EXPECT_FALSE(workflow_.view().asks_for_instruments);
  show_frame();
  EXPECT_TRUE(overlaid()) << reason();
}

/// The pedal is pressed after a reconnection, before the appliance has told which tracker it has.
TEST_F(HeldBack, APersonsWordDoesNotMakeAnotherTrackerOfOneThatIsToldLater) {
  workflow_.set_link(false, "gone");
  workflow_.set_link(true, "connected");
  show_frame();
  workflow_.set_link(true, "connected");
  workflow_.primary(HostTime{0});
  tell_health(workflow_, kOtherTracker);
  give_record(workflow_);
  show_frame();
  EXPECT_FALSE(overlaid()) << "a person does not overrule a tracker";
  EXPECT_NE(reason().find("4712"), std::string::npos) << reason();
  tell_health(workflow_);
  show_frame();
  EXPECT_TRUE(overlaid()) << reason();
}

/// A fiducial that is dropped meanwhile is in no fit any more.
TEST_F(HeldBack, WhatIsFittedAnewMeanwhileIsFittedOnceItIsBack) {
  ASSERT_EQ(workflow_.view().touches.size(), 4U);
  workflow_.set_link(false, "gone");
  workflow_.drop_marker(kFiducials[3]);
  workflow_.set_link(true, "connected");
  tell_health(workflow_);
  give_record(workflow_);
  workflow_.set_link(true, "connected");
  EXPECT_TRUE(workflow_.view().fits_poorly || !workflow_.view().touches[3].residual_mm)
      << "the touch of a fiducial that there is none of fits nothing";
}

TEST_F(HeldBack, AfterAPauseSomebodyLooksWhetherTheRegistrationHolds) {
  show_frame(9'000);
  EXPECT_TRUE(overlaid()) << reason();
  show_frame(11'000);
  EXPECT_FALSE(overlaid());
  EXPECT_TRUE(workflow_.view().unconfirmed);
  EXPECT_EQ(workflow_.view().step, LiveStep::check);
  birdseye::testing::confirm(workflow_);
  show_frame();
  EXPECT_TRUE(overlaid()) << reason();
}

/// Taken up from a folder: found by the board, with tracker and camera.
TEST(HeldBackOnResume, AnotherCameraTakesUpNoCalibrationByTheBoard) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.resume = scratch.path();
  Operation kept;
  kept.ct_sha256 = read_patient(settings.patient)->ct_sha256;
  kept.made_utc = "2026-11-22T10:00:00Z";
  calibration::HandEyeResult found;
  found.held_out_px = 1;
  kept.calibrated = {
      ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, 0.3, found), kept.made_utc, true, {kTracker, kCamera, 0}};
  kept.registered = {kTrackerFromPatient, 0.3, kFiducials, {kTracker, {}, 0}};
  ASSERT_TRUE(write_operation(scratch.path(), kept, *testing::authors().machine));
  LiveWorkflow workflow(settings);
  load(workflow);
  EXPECT_EQ(workflow.view().fault, "");
  EXPECT_FALSE(workflow.view().note(LiveStep::calibrate).done) << "nothing is connected yet";
  workflow.set_link(true, "connected");
  tell_health(workflow, kTracker, kOtherCamera);
  workflow.set_link(true, "connected");
  EXPECT_FALSE(workflow.view().note(LiveStep::calibrate).done);
  EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).done);
  EXPECT_NE(workflow.view().note(LiveStep::calibrate).line.find("B2"), std::string::npos)
      << workflow.view().note(LiveStep::calibrate).line;
  tell_health(workflow, kTracker, kCamera);
  EXPECT_TRUE(workflow.view().note(LiveStep::calibrate).done);
  EXPECT_EQ(workflow.view().step, LiveStep::check) << "and somebody has to look first";
  EXPECT_FALSE(workflow.picture().setup().has_value());
  birdseye::testing::confirm(workflow);
  EXPECT_TRUE(workflow.picture().setup().has_value());
}

}  // namespace
}  // namespace birdseye::host
