// The workflow of the live window without a window: fed with events as an appliance sends them.
#include <gtest/gtest.h>

#include "drivers/system/wait.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect_and_calibrate;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::load;
using birdseye::testing::operation_settings;
using birdseye::testing::Scratch;

TEST(LiveWorkflow, GoesFromTheLinkToARegisteredPatient) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_FALSE(workflow.picture().setup().has_value());
    hand.rest_at(kFiducials[i], 80);
    hand.rest_at(kFiducials[i] + Eigen::Vector3d(0, 0, 40), 1);
    EXPECT_EQ(workflow.view().touches.size(), i + 1);
  }
  // With three there is a fit, and it is shown; which is which is not yet sure enough to go on.
  ASSERT_TRUE(workflow.view().fre_mm.has_value()) << workflow.view().registration_fault;
  EXPECT_FALSE(workflow.view().note(LiveStep::fiducials).done);
  hand.rest_at(kFiducials[3], 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_EQ(workflow.view().step, LiveStep::views);
  workflow.go_on();
  workflow.go_on();
  EXPECT_EQ(workflow.view().step, LiveStep::check);
  EXPECT_LT(*workflow.view().fre_mm, 0.05);
  ASSERT_TRUE(workflow.picture().setup().has_value());
  const auto& found = workflow.picture().setup()->tracker_from_patient();
  EXPECT_LT((found.translation() - kTrackerFromPatient.translation()).norm(), 0.1);
  hand.rest_at(Eigen::Vector3d(30, 30, 22), 30);
  const auto reading = workflow.view().check;
  ASSERT_TRUE(reading.has_value());
  EXPECT_EQ(reading->nearest, "tumour");
  EXPECT_NEAR(reading->distance_mm, 2, 0.1);
  workflow.go_on();
  EXPECT_EQ(workflow.view().step, LiveStep::run);
}

TEST(LiveWorkflow, TheCtIsSeenFromElsewhereOnceItCanBeDrawn) {
  const Scratch scratch;
  CameraModel camera;
  camera.width_px = 40;
  camera.height_px = 30;
  camera.fx_px = camera.fy_px = 40;
  camera.cx_px = 20;
  camera.cy_px = 15;
  // The ball about the patient's origin, from 80 mm.
  const Transform<Camera, Patient> camera_from_patient(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0, 0, 80));
  EXPECT_FALSE(LiveWorkflow(LiveSettings{}).ct_seen_from(camera, camera_from_patient, {}).has_value());
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  EXPECT_EQ(workflow.view().engine_name.substr(0, 3), "cpu") << workflow.view().fault;
  const auto ct = workflow.ct_seen_from(camera, camera_from_patient, {});
  ASSERT_TRUE(ct.has_value());
  ASSERT_EQ(ct->rgba.size(), std::size_t{4} * 40 * 30);
  const std::size_t middle = 4 * (std::size_t{15} * 40 + 20);
  EXPECT_GT(ct->rgba[middle + 3], 0) << "the ball";
  EXPECT_EQ(ct->rgba[3], 0) << "the air beside it";
}

TEST(OperationView, SlicesOpenAtTheTargetButAtAFiducialWhileTheseAreTouched) {
  OperationView operation;
  operation.step = LiveStep::run;
  EXPECT_FALSE(first_place_mm(operation).has_value());
  operation.markers_in_patient_mm = {{1, 2, 3}};
  EXPECT_EQ(*first_place_mm(operation), Eigen::Vector3d(1, 2, 3)) << "where there is no target";
  operation.landmarks = {{"tumour", {30, 30, 20}}};
  EXPECT_EQ(*first_place_mm(operation), Eigen::Vector3d(30, 30, 20));
  operation.step = LiveStep::fiducials;
  EXPECT_EQ(*first_place_mm(operation), Eigen::Vector3d(1, 2, 3));
}

TEST(OperationView, TheButtonSaysWaitWhereAPressWouldDoNothing) {
  OperationView operation;
  operation.step = LiveStep::fiducials;
  EXPECT_EQ(primary_words(operation), "take this point");
  operation.simulated = true;
  EXPECT_EQ(primary_words(operation), "wait for the touches");
  operation.step = LiveStep::deform;
  operation.deforming = true;
  EXPECT_EQ(primary_words(operation), "matching: wait") << "a foot that presses twice must not cancel it";
}

TEST(LiveWorkflow, AServerThatIsNoApplianceIsReadyWhenItSendsVideoAndPoses) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  workflow.set_link(true, "connected");
  EXPECT_FALSE(workflow.view().note(LiveStep::connect).done);
  wire::VideoFrame frame;
  frame.width_px = frame.height_px = 1;
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3);
  workflow.take(wire::Status{false, "several devices send poses"}, HostTime{0}, std::nullopt);
  workflow.take(frame, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_FALSE(workflow.view().note(LiveStep::connect).done);
  EXPECT_EQ(workflow.view().note(LiveStep::connect).line, "several devices send poses");
  EXPECT_EQ(workflow.view().step, LiveStep::connect);
  workflow.take(wire::Status{true, ""}, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_TRUE(workflow.view().note(LiveStep::connect).done);
  EXPECT_EQ(workflow.view().step, LiveStep::calibrate);
  // What one server said is not held against the next.
  workflow.take(wire::Status{false, "poses and no video"}, HostTime{0}, std::nullopt);
  workflow.set_link(false, "gone");
  workflow.set_link(true, "connected");
  EXPECT_TRUE(workflow.view().note(LiveStep::connect).done);
}

TEST(LiveWorkflow, SaysWhatIsWrongWithThePatientsFiles) {
  const Scratch scratch;
  LiveSettings wrong = operation_settings(scratch);
  wrong.patient.ct = scratch / "nothere";
  LiveWorkflow workflow(wrong);
  for (int i = 0; i < 1000 && workflow.view().fault.empty(); ++i) {
    sleep_for(Duration::from_ms(10));
    workflow.tick();
  }
  EXPECT_NE(workflow.view().fault.find("nothere"), std::string::npos);
  LiveSettings unknown = operation_settings(scratch);
  unknown.transfer = "no such preset";
  EXPECT_NE(LiveWorkflow(unknown).view().fault.find("no such preset"), std::string::npos);
}

TEST(LiveWorkflow, ALostLinkIsSaidAndNothingOfItStays) {
  LiveWorkflow workflow{LiveSettings{}};
  wire::Health health;
  health.state = "ready";
  workflow.take(health, HostTime{0}, std::nullopt);
  workflow.set_link(true, "connected");
  EXPECT_TRUE(workflow.view().note(LiveStep::connect).done);
  workflow.set_link(false, "127.0.0.1:18944: the appliance has gone");
  EXPECT_FALSE(workflow.view().note(LiveStep::connect).done);
  EXPECT_FALSE(workflow.view().link.health.has_value());
  EXPECT_EQ(workflow.view().link.words, "127.0.0.1:18944: the appliance has gone");
}

}  // namespace
}  // namespace birdseye::host
