// Strokes over the organ in the order of the operation: when they count, what takes them back, and that a deformation
// is found by them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect_and_calibrate;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::kMs;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::load;
using birdseye::testing::looking_at;
using birdseye::testing::operation_settings;
using birdseye::testing::Scratch;

/// An operation whose patient is registered: its step is that of the views.
class LiveStrokes : public ::testing::Test {
 protected:
  LiveStrokes() : workflow_(operation_settings(scratch_)), hand_(workflow_) {}

  void SetUp() override {
    load(workflow_);
    connect_and_calibrate(workflow_);
    for (const Eigen::Vector3d& fiducial : kFiducials) hand_.rest_at(fiducial, 80);
    hand_.rest_at({0, 0, 20}, 1);
    ASSERT_EQ(workflow_.view().step, LiveStep::views);
  }

  /// Over so many millimetres of a plane, at 30 mm/s.
  void stroke_mm(int length_mm) {
    for (int mm = 0; mm < length_mm; mm += 9) hand_.rest_at({static_cast<double>(mm), 0, 20}, 0);
    hand_.rest_at({0, 0, 20}, 0);
  }

  void keep_view() {
    workflow_.take(looking_at(workflow_, Eigen::Vector3d::Zero(), 100, 0.2), HostTime{0}, ClockGap{});
    workflow_.draw();
    workflow_.primary(HostTime{0});
  }

  [[nodiscard]] std::string note() const { return workflow_.view().note(LiveStep::views).line; }

  const Scratch scratch_;
  LiveWorkflow workflow_;
  Hand hand_;
};

TEST_F(LiveStrokes, TouchTheOrganWhereThePatientsFrameHasIt) {
  stroke_mm(90);
  EXPECT_EQ(workflow_.view().touched_places, 0U) << "nobody said that it is a stroke";
  workflow_.stroke();
  EXPECT_TRUE(workflow_.view().stroking);
  stroke_mm(90);
  workflow_.stroke();
  const OperationView view = workflow_.view();
  EXPECT_FALSE(view.stroking);
  EXPECT_GT(view.touched_places, 20U);
  EXPECT_EQ(note(), fmt::format("{} places touched", view.touched_places));
  stroke_mm(90);
  EXPECT_EQ(workflow_.view().touched_places, view.touched_places);
  EXPECT_FALSE(view.note(LiveStep::views).done) << "of five views there is none";
}

TEST_F(LiveStrokes, AreTakenBackInTheOrderInWhichViewsAndStrokesWereMade) {
  workflow_.stroke();
  stroke_mm(50);
  workflow_.stroke();
  const std::size_t first = workflow_.view().touched_places;
  keep_view();
  ASSERT_EQ(note(), fmt::format("1 views kept, {} places touched", first));
  workflow_.stroke();
  stroke_mm(50);
  workflow_.stroke();
  EXPECT_GT(workflow_.view().touched_places, first);
  workflow_.undo();
  EXPECT_EQ(note(), fmt::format("1 views kept, {} places touched", first));
  workflow_.undo();
  EXPECT_EQ(note(), fmt::format("0 views kept, {} places touched", first));
  workflow_.undo();
  EXPECT_EQ(note(), "0 views kept");
}

TEST_F(LiveStrokes, AreForgottenWithTheRegistrationThatTheyAreOf) {
  workflow_.stroke();
  stroke_mm(50);
  ASSERT_GT(workflow_.view().touched_places, 0U);
  workflow_.go_to(LiveStep::fiducials);
  EXPECT_FALSE(workflow_.view().stroking) << "another step ends it";
  EXPECT_GT(workflow_.view().touched_places, 0U);
  workflow_.undo();
  EXPECT_GT(workflow_.view().touched_places, 0U) << "it is said first what is lost";
  workflow_.undo();
  EXPECT_EQ(workflow_.view().touched_places, 0U);
  EXPECT_EQ(note(), "the fiducials were touched anew: keep views again");
  workflow_.go_to(LiveStep::views);
  workflow_.go_to(LiveStep::fiducials);
  hand_.rest_at(kFiducials.back(), 80);
  hand_.rest_at({0, 0, 20}, 1);
  ASSERT_EQ(workflow_.view().step, LiveStep::views);
  workflow_.stroke();
  stroke_mm(50);
  ASSERT_GT(workflow_.view().touched_places, 0U);
  auto anew = birdseye::testing::example_record(768, 576, {}, {});
  anew.hand_eye->provenance.made_utc = "2026-11-22T09:40:00Z";
  birdseye::testing::give_record(workflow_, anew);
  EXPECT_EQ(workflow_.view().touched_places, 0U);
  EXPECT_FALSE(workflow_.view().stroking);
  EXPECT_EQ(note(), "the scope was calibrated anew: keep views again");
}

TEST(LiveStroke, BelongsToTheViewsOfARegisteredPatient) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  load(workflow);
  connect_and_calibrate(workflow);
  workflow.stroke();
  EXPECT_EQ(workflow.view().stroke_line, "");
  workflow.go_to(LiveStep::views);
  workflow.stroke();
  EXPECT_FALSE(workflow.view().stroking);
  EXPECT_EQ(workflow.view().stroke_line, "no stroke: the patient is not registered yet");
}

}  // namespace
}  // namespace birdseye::host
