// What was found and touched before a registration came into doubt: what of it counts after.
#include <gtest/gtest.h>

#include "calibration/geometry/rotations.hpp"
#include "tests/host/operation/doubted_fixture.hpp"
#include "tests/support/looking_about.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::check_at;
using birdseye::testing::confirm;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::kTumour;

constexpr const char* kViewsDoubted = "the registration came into doubt since: keep views again";

std::string line_of_views(const LiveWorkflow& workflow) {
  return workflow.view().note(LiveStep::views).line;
}

/// The scope has a pose, and the frame an overlay.
void keep_a_view(LiveWorkflow& workflow) {
  workflow.go_to(LiveStep::views);
  workflow.take(birdseye::testing::looking_at(workflow, kTumour, 100, 0.2), HostTime{0}, ClockGap{});
  workflow.draw();
  workflow.primary(HostTime{0});
  ASSERT_EQ(line_of_views(workflow), "1 views kept");
}

/// A fit of touches of before and after would be of two setups.
TEST_F(Doubted, IsRegisteredAnewByTouchesOfAfterAlone) {
  pause();
  workflow_.go_to(LiveStep::fiducials);
  workflow_.take_back(3);
  ASSERT_EQ(workflow_.view().touches.size(), 3U);
  const Eigen::Vector3d moved_mm(3, 0, -4);
  Hand hand(workflow_);
  hand.rest_at(kFiducials[3] + moved_mm, 80);
  hand.rest_at({0, 0, 200}, 1);
  EXPECT_EQ(workflow_.view().touches.size(), 1U);
  EXPECT_EQ(workflow_.view().note(LiveStep::fiducials).line, "1 touched anew, dropped from before: 3");
  EXPECT_FALSE(drawn());
  for (std::size_t i = 0; i < 3; ++i) hand.rest_at(kFiducials[i] + moved_mm, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(drawn());
  const Eigen::Vector3d found_mm = workflow_.picture().setup()->tracker_from_patient().translation();
  EXPECT_LT((found_mm - kTrackerFromPatient * moved_mm).norm(), 0.1);
}

/// Two landmarks that fit to some millimetres tell nothing of how views of before and after lie to each other.
TEST_F(Doubted, HasNoViewsOfBefore) {
  keep_a_view(workflow_);
  pause();
  EXPECT_EQ(line_of_views(workflow_), kViewsDoubted);
  EXPECT_FALSE(workflow_.view().note(LiveStep::views).done);
  confirm(workflow_);
  ASSERT_TRUE(drawn()) << said();
  keep_a_view(workflow_);  // from where the former was kept
}

TEST_F(Doubted, KeepsItsViewsWhereALandmarkWasOffAndThenFits) {
  keep_a_view(workflow_);
  workflow_.go_to(LiveStep::check);
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 12));
  ASSERT_FALSE(drawn());
  EXPECT_EQ(line_of_views(workflow_), "1 views kept");
  confirm(workflow_);
  ASSERT_TRUE(drawn()) << said();
  EXPECT_EQ(line_of_views(workflow_), "1 views kept");
}

/// Fewer of the same touches are no other setup: the landmark that was off speaks against these too.
TEST_F(Doubted, IsNotConfirmedByFittedFiducialsOnceATouchWasTakenBack) {
  check_at(workflow_, kTumour + Eigen::Vector3d(0, 0, 12));
  ASSERT_FALSE(drawn());
  workflow_.go_to(LiveStep::fiducials);
  workflow_.take_back(3);
  ASSERT_EQ(workflow_.view().touches.size(), 3U);
  workflow_.go_to(LiveStep::check);
  check_at(workflow_, kFiducials[0]);
  check_at(workflow_, kFiducials[1]);
  EXPECT_FALSE(drawn()) << said();
  check_at(workflow_, kTumour);
  EXPECT_TRUE(drawn()) << said();
}

/// A map of the field gives all poses another frame. What the appliance tells of it is whether nobody known signed it.
TEST_F(Doubted, IsARegistrationOnceTheMapOfTheFieldIsAnother) {
  wire::Health health;
  health.state = "ready";
  health.instruments = {{"tracker", "running", "", 0, birdseye::testing::kTracker},
                        {"camera", "running", "", 0, birdseye::testing::kCamera}};
  workflow_.take(health, HostTime{0}, std::nullopt);
  EXPECT_TRUE(drawn());
  health.field_unsigned = "not signed: nobody says who wrote it";
  workflow_.take(health, HostTime{0}, std::nullopt);
  EXPECT_FALSE(drawn());
  EXPECT_NE(said().find("the map of the tracker's field is another"), std::string::npos) << said();
  confirm(workflow_);
  workflow_.take(health, HostTime{0}, std::nullopt);
  EXPECT_TRUE(drawn()) << said();
}

/// The pointer was exchanged, or its tip measured anew: with that tip other places would have been touched.
TEST(LiveWorkflow, ARegistrationIsInDoubtOnceTheRecordHasAnotherTip) {
  const birdseye::testing::Scratch scratch;
  LiveSettings settings = birdseye::testing::operation_settings(scratch);
  auto record = birdseye::testing::straight_scope_record();
  record.tip->tip_in_sensor_mm = *settings.tip_in_pointer_mm;
  settings.tip_in_pointer_mm.reset();
  LiveWorkflow workflow(settings);
  birdseye::testing::load(workflow);
  birdseye::testing::connect(workflow);
  birdseye::testing::give_record(workflow, record);
  workflow.go_to(LiveStep::fiducials);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_TRUE(workflow.picture().setup().has_value());
  birdseye::testing::give_record(workflow, record);
  EXPECT_TRUE(workflow.picture().setup().has_value()) << "it is the same record";
  keep_a_view(workflow);
  auto without_tip = record;
  without_tip.tip.reset();
  birdseye::testing::give_record(workflow, without_tip);
  EXPECT_TRUE(workflow.picture().setup().has_value()) << "nothing is touched without one";
  EXPECT_EQ(line_of_views(workflow), "1 views kept");
  record.tip->tip_in_sensor_mm.z() += 5;
  birdseye::testing::give_record(workflow, record);
  EXPECT_FALSE(workflow.picture().setup().has_value());
  EXPECT_EQ(line_of_views(workflow), "the pointer's tip is another: keep views again");
  const std::string said = workflow.view().note(LiveStep::check).line;
  EXPECT_NE(said.find("the pointer's tip is another"), std::string::npos) << said;
  confirm(workflow);
  EXPECT_TRUE(workflow.picture().setup().has_value());
}

/// A person has said where it is.
TEST_F(Doubted, IsNotARegistrationBecauseOfATipThatIsNotUsed) {
  keep_a_view(workflow_);
  auto record = birdseye::testing::straight_scope_record();
  record.tip->tip_in_sensor_mm.z() += 5;
  birdseye::testing::give_record(workflow_, record);
  EXPECT_TRUE(drawn());
  EXPECT_EQ(line_of_views(workflow_), "1 views kept");
}

/// What LookingAbout shows, to the window.
struct ToWorkflow {
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) const {
    wire::Birds birds;
    birds.acquired = acquired;
    birds.birds.push_back({"scope", tracker_from_sensor});
    workflow->take(birds, HostTime{acquired.ns}, ClockGap{});
  }
  void take(const wire::VideoFrame& frame, const ScopeSetup&) const {
    workflow->take(frame, HostTime{frame.info.acquired.ns}, ClockGap{});
  }
  LiveWorkflow* workflow = nullptr;
};

/// Whoever confirms a registration while the video still contradicts has seen nothing of what it contradicts next.
TEST(LiveWorkflow, AVideoThatContradictsAgainDropsStrokesAndSpaceTouchesAnew) {
  const birdseye::testing::Scratch scratch;
  LiveSettings settings = birdseye::testing::operation_settings(scratch);
  settings.video_must_agree = true;
  LiveWorkflow workflow(settings);
  birdseye::testing::LookingAbout<ToWorkflow> about;
  about.motion.workflow = &workflow;
  auto record = birdseye::testing::straight_scope_record(birdseye::testing::kLookingScope.width_px,
                                                         birdseye::testing::kLookingScope.height_px);
  record.lens->camera = birdseye::testing::kLookingScope;
  record.hand_eye->camera_from_sensor =
      Transform<Camera, Camera>(rotation_exp(Eigen::Vector3d(0.5, 0, 0)), Eigen::Vector3d::Zero()) *
      about.camera_from_sensor;
  birdseye::testing::load(workflow);
  birdseye::testing::connect(workflow);
  birdseye::testing::give_record(workflow, record);
  workflow.go_to(LiveStep::fiducials);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
  ASSERT_EQ(workflow.view().touches.size(), 4U);
  about.look(0, 10);
  ASSERT_TRUE(workflow.view().unconfirmed) << "it contradicts";
  workflow.go_to(LiveStep::check);
  confirm(workflow);
  ASSERT_FALSE(workflow.view().unconfirmed) << workflow.view().note(LiveStep::check).line;
  workflow.go_to(LiveStep::views);
  workflow.stroke();
  for (int mm = 0; mm < 90; mm += 9) hand.rest_at({static_cast<double>(mm), 0, 20}, 0);
  workflow.stroke();
  ASSERT_GT(workflow.view().touched_places, 0U);
  about.look(10, 10);
  EXPECT_FALSE(workflow.view().unconfirmed) << "it is not asked at each picture";
  EXPECT_EQ(workflow.view().touched_places, 0U);
  EXPECT_EQ(line_of_views(workflow), kViewsDoubted);
  workflow.go_to(LiveStep::fiducials);
  workflow.primary(HostTime{20'000 * birdseye::testing::kMs});
  EXPECT_EQ(workflow.view().step, LiveStep::fiducials) << "a touch would begin anew";
  hand.rest_at(kFiducials[0], 30);
  workflow.primary(HostTime{0});
  EXPECT_EQ(workflow.view().touches.size(), 1U);
}

/// At what angle the rod of the scope is that has just come nobody has said.
TEST(LiveWorkflow, AnotherScopesRodIsNotAtTheAngleOfTheFormer) {
  const birdseye::testing::Scratch scratch;
  LiveSettings settings = birdseye::testing::operation_settings(scratch);
  settings.rod_angle_deg = 40;
  auto record = birdseye::testing::straight_scope_record();
  record.hand_eye->rod = calibration::RodEntry{30, {0, 0, 1}, {0, 0, 0}, 1};
  LiveWorkflow workflow(settings);
  birdseye::testing::load(workflow);
  birdseye::testing::connect(workflow);
  birdseye::testing::give_record(workflow, record);
  EXPECT_EQ(workflow.view().rod_angle_deg, 40) << "said with the first";
  birdseye::testing::give_record(workflow, record);
  EXPECT_EQ(workflow.view().rod_angle_deg, 40) << "it is the same";
  record.scope += " of another make";
  record.hand_eye->provenance.made_utc = "2026-11-20T10:00:00Z";
  record.hand_eye->rod->reference_angle_deg = -20;
  birdseye::testing::give_record(workflow, record);
  EXPECT_TRUE(workflow.view().has_rod);
  EXPECT_FALSE(workflow.view().rod_angle_deg);
  workflow.turn_rod(0);
  EXPECT_EQ(workflow.view().rod_angle_deg, -20) << "as it was calibrated";
}

}  // namespace
}  // namespace birdseye::host
