// A deformed organ that moves again, by checks that say so: their results are given here.
#include "host/operation/organ_motion.hpp"

#include <gtest/gtest.h>

#include <random>

#include "drivers/system/wait.hpp"
#include "host/operation/operation.hpp"
#include "tests/support/live_operation.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::give_record;
using birdseye::testing::kFiducials;
using birdseye::testing::kMs;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::load;
using birdseye::testing::operation_settings;
using birdseye::testing::Scratch;

/// At that second.
CheckedSurface said(SurfaceVerdict verdict, int at_s) {
  SurfaceFinding finding;
  finding.verdict = verdict;
  if (verdict == SurfaceVerdict::cannot_tell) {
    finding.words = "smoke";
  } else {
    finding.figure_mm = verdict == SurfaceVerdict::moved ? 5.0 : 0.4;
    finding.bound_mm = 2.0;
    finding.words = verdict == SurfaceVerdict::moved ? "5.0 mm off" : "0.4 mm off";
  }
  return {finding, HostTime{at_s * 1000 * kMs}};
}

HostTime at_second(int s) {
  return HostTime{s * 1000 * kMs};
}

constexpr SurfaceVerdict kHolds = SurfaceVerdict::holds, kMoved = SurfaceVerdict::moved,
                         kCannotTell = SurfaceVerdict::cannot_tell;

TEST(OrganMotion, TakesTwoChecksInARowEitherWay) {
  OrganMotion motion;
  EXPECT_FALSE(motion.take(said(kMoved, 0)));
  EXPECT_FALSE(motion.take(said(kHolds, 1)));
  EXPECT_FALSE(motion.take(said(kMoved, 2))) << "one odd frame and another";
  EXPECT_FALSE(motion.moved_mm().has_value());
  EXPECT_TRUE(motion.take(said(kMoved, 3)));
  ASSERT_TRUE(motion.moved_mm().has_value());
  EXPECT_EQ(*motion.moved_mm(), 5);
  EXPECT_FALSE(motion.take(said(kHolds, 4)));
  EXPECT_FALSE(motion.take(said(kMoved, 5)));
  EXPECT_FALSE(motion.take(said(kHolds, 6)));
  EXPECT_TRUE(motion.moved_mm().has_value());
  EXPECT_TRUE(motion.take(said(kHolds, 7)));
  EXPECT_FALSE(motion.moved_mm().has_value());
}

TEST(OrganMotion, WhatCannotBeToldChangesNothingAndIsToldAfterTenSeconds) {
  OrganMotion motion;
  (void)motion.take(said(kHolds, 0));
  for (int s = 1; s <= 10; ++s) {
    EXPECT_FALSE(motion.take(said(kCannotTell, s)));
    EXPECT_EQ(motion.line(at_second(s)), "surface: 0.4 mm off");
    EXPECT_TRUE(motion.told(at_second(s)));
  }
  EXPECT_FALSE(motion.take(said(kCannotTell, 11)));
  EXPECT_EQ(motion.line(at_second(11)), "for 10 s it cannot be told whether the organ has moved: smoke");
  EXPECT_FALSE(motion.told(at_second(11)));
  // Nor does it stand between two that say the same.
  EXPECT_FALSE(motion.take(said(kMoved, 12)));
  EXPECT_FALSE(motion.take(said(kCannotTell, 13)));
  EXPECT_TRUE(motion.take(said(kMoved, 14)));
  for (int s = 15; s < 40; ++s) EXPECT_FALSE(motion.take(said(kCannotTell, s)));
  EXPECT_TRUE(motion.moved_mm().has_value());
}

TEST(OrganMotion, HasToldNothingBeforeACheckThatCould) {
  OrganMotion motion;
  EXPECT_TRUE(motion.unchecked());
  (void)motion.take(said(kCannotTell, 0));
  EXPECT_TRUE(motion.unchecked());
  EXPECT_FALSE(motion.told(at_second(0)));
  (void)motion.take(said(kHolds, 1));
  EXPECT_FALSE(motion.unchecked());
  EXPECT_TRUE(motion.told(at_second(1)));
}

/// The line over the picture may not turn green by it.
TEST(OrganMotion, AFirstCheckThatSaysItHasMovedBearsNothingOut) {
  OrganMotion motion;
  (void)motion.take(said(kMoved, 0));
  EXPECT_FALSE(motion.unchecked());
  EXPECT_FALSE(motion.told(at_second(0)));
  EXPECT_EQ(motion.line(at_second(30)), "surface: 5.0 mm off");
  EXPECT_TRUE(motion.take(said(kMoved, 1)));
  EXPECT_TRUE(motion.told(at_second(1)));
}

/// As where no pose comes that is to be believed, or a check does not end.
TEST(OrganMotion, WhatWasFoundGrowsOldWhereNothingIsCheckedAnyMore) {
  OrganMotion motion;
  (void)motion.take(said(kHolds, 0));
  EXPECT_TRUE(motion.told(at_second(10)));
  EXPECT_FALSE(motion.told(at_second(30)));
  EXPECT_EQ(motion.line(at_second(30)), "for 30 s no check has borne out what was found");
  (void)motion.take(said(kHolds, 31));
  EXPECT_TRUE(motion.told(at_second(31)));
  EXPECT_EQ(motion.line(at_second(31)), "surface: 0.4 mm off");
}

/// The scope at its place, or so many mm beside it, looking at the CT's middle.
wire::VideoFrame frame_at(const LiveWorkflow& workflow, int at_s, double beside_mm = 0) {
  const Setup& setup = *workflow.picture().setup();
  const Transform<Camera, Patient> camera_from_patient(Eigen::Matrix3d::Identity(),
                                                       Eigen::Vector3d(-30 + beside_mm, -30, 80));
  wire::VideoFrame frame;
  frame.width_px = setup.camera().width_px;
  frame.height_px = setup.camera().height_px;
  frame.rgb = std::make_shared<std::vector<std::uint8_t>>(std::size_t{3} * 768 * 576, 90);
  frame.info.acquired = DeviceTime{at_s * 1000 * kMs};
  frame.info.pose.kind = PoseKind::exact;
  frame.info.pose.position_sigma_mm = 0.2;
  frame.info.pose.tracker_from_sensor =
      setup.tracker_from_patient() * camera_from_patient.inverse() * setup.camera_from_sensor();
  return frame;
}

ShownPicture shown_after(LiveWorkflow& workflow, int at_s) {
  workflow.take(frame_at(workflow, at_s), HostTime{at_s * 1000 * kMs}, ClockGap{});
  workflow.draw();
  return workflow.shown_at(HostTime{at_s * 1000 * kMs});
}

/// With a deformation, and the overlay drawn.
class DeformedOperation : public ::testing::Test {
 protected:
  void SetUp() override {
    LiveSettings settings = operation_settings(scratch_);
    Operation kept;
    kept.ct_sha256 = read_patient(settings.patient)->ct_sha256;
    kept.made_utc = "2026-11-22T10:00:00Z";
    kept.registered = {kTrackerFromPatient, 0.3, kFiducials, {birdseye::testing::kTracker, {}, 0}};
    kept.calibrated = birdseye::testing::calibrated_by(birdseye::testing::straight_scope_record());
    kept.deformed = birdseye::testing::moved_to_the_left();
    ASSERT_TRUE(write_operation(scratch_.path(), kept, *testing::authors().machine));
    settings.resume = scratch_.path();
    workflow_.emplace(settings);
    birdseye::testing::connect(*workflow_);
    load(*workflow_);
    ASSERT_EQ(workflow_->view().fault, "");
    give_record(*workflow_);
    birdseye::testing::confirm(*workflow_);
    ASSERT_TRUE(workflow_->picture().setup().has_value());
  }

  Scratch scratch_;
  std::optional<LiveWorkflow> workflow_;
};

TEST_F(DeformedOperation, LosesItsOverlayWhereTheOrganMovesAndGetsItBack) {
  LiveWorkflow& workflow = *workflow_;
  EXPECT_TRUE(shown_after(workflow, 1).overlaid);
  workflow.take(said(kMoved, 1));
  EXPECT_TRUE(shown_after(workflow, 2).overlaid);
  workflow.take(said(kMoved, 2));
  EXPECT_FALSE(workflow.shown_at(HostTime{2000 * kMs}).overlaid) << "nor the frame that is on the screen";
  const ShownPicture withdrawn = shown_after(workflow, 3);
  EXPECT_FALSE(withdrawn.overlaid);
  EXPECT_NE(withdrawn.reason.find("the organ has moved since the views"), std::string::npos) << withdrawn.reason;
  EXPECT_TRUE(workflow.view().organ_moved);
  EXPECT_TRUE(workflow.view().note(LiveStep::deform).done);
  EXPECT_FALSE(workflow.view().note(LiveStep::deform).holds()) << "no tick while the alarm stands";
  EXPECT_NE(workflow.view().note(LiveStep::deform).doubt.find("the organ has moved"), std::string::npos);
  EXPECT_TRUE(workflow.view().note(LiveStep::fiducials).holds()) << "of which nothing is doubted";
  EXPECT_FALSE(workflow.view().target.has_value());
  workflow.take(said(kCannotTell, 3));
  EXPECT_FALSE(shown_after(workflow, 4).overlaid);
  workflow.take(said(kHolds, 4));
  EXPECT_FALSE(shown_after(workflow, 5).overlaid);
  workflow.take(said(kHolds, 5));
  const ShownPicture back = shown_after(workflow, 6);
  EXPECT_TRUE(back.overlaid) << back.reason;
  EXPECT_EQ(back.strength, 1);
  EXPECT_TRUE(workflow.view().note(LiveStep::deform).holds());
}

TEST_F(DeformedOperation, KeepsViewsAnewThoughItsOverlayIsWithdrawn) {
  LiveWorkflow& workflow = *workflow_;
  (void)shown_after(workflow, 1);
  workflow.go_to(LiveStep::views);
  workflow.primary(HostTime{0});
  ASSERT_EQ(workflow.view().note(LiveStep::views).line, "1 views kept");
  EXPECT_EQ(workflow.view().primary_refused, "view 1 was kept from here: move the scope by 5 mm or more");
  workflow.take(said(kMoved, 1));
  workflow.take(said(kMoved, 2));
  EXPECT_NE(workflow.view().note(LiveStep::views).line.find("moved since"), std::string::npos);
  EXPECT_FALSE(shown_after(workflow, 3).overlaid);
  workflow.primary(HostTime{0});
  EXPECT_EQ(workflow.view().note(LiveStep::views).line, "1 views kept") << "the old one is not among them";
}

TEST_F(DeformedOperation, SpaceLeavesTheMatchingAloneAndAKeyOfItsOwnCancelsIt) {
  LiveWorkflow& workflow = *workflow_;
  workflow.go_to(LiveStep::deform);
  workflow.undo();
  workflow.go_to(LiveStep::views);
  std::mt19937 random(1);
  for (int n = 1; n <= 2; ++n) {
    wire::VideoFrame frame = frame_at(workflow, n, 10.0 * n);
    auto noise = std::make_shared<std::vector<std::uint8_t>>(frame.rgb->size());
    for (std::uint8_t& byte : *noise) byte = static_cast<std::uint8_t>(random());
    frame.rgb = noise;
    workflow.take(frame, HostTime{n * 1000 * kMs}, ClockGap{});
    workflow.primary(HostTime{0});
  }
  ASSERT_EQ(workflow.view().note(LiveStep::views).line, "2 views kept");
  workflow.go_to(LiveStep::deform);
  // The pictures are noise, and so nothing is found: in words other than those of a matching that was called off.
  const auto end_of = [&workflow] {
    for (int i = 0; i < 6000 && workflow.view().deforming; ++i) sleep_for(Duration::from_ms(10));
    workflow.tick();
    EXPECT_FALSE(workflow.view().deforming);
    return workflow.view().note(LiveStep::deform).line;
  };
  ASSERT_EQ(workflow.view().primary_refused, "");
  workflow.primary(HostTime{0});
  ASSERT_TRUE(workflow.view().deforming);
  EXPECT_NE(workflow.view().primary_refused, "");
  workflow.primary(HostTime{0});
  EXPECT_EQ(end_of().find("called off"), std::string::npos);
  workflow.primary(HostTime{0});
  workflow.cancel_matching();
  const std::string line = end_of();
  EXPECT_NE(line.find("called off"), std::string::npos) << line;
}

TEST_F(DeformedOperation, GetsItsOverlayBackWhereTheDeformationIsUndone) {
  LiveWorkflow& workflow = *workflow_;
  workflow.take(said(kMoved, 1));
  workflow.take(said(kMoved, 2));
  EXPECT_FALSE(shown_after(workflow, 3).overlaid);
  workflow.go_to(LiveStep::deform);
  workflow.undo();
  EXPECT_FALSE(workflow.view().organ_moved);
  EXPECT_EQ(workflow.view().surface_check, "");
  EXPECT_TRUE(shown_after(workflow, 4).overlaid);
  // Without a deformation there is nothing to check.
  workflow.take(said(kMoved, 4));
  workflow.take(said(kMoved, 5));
  EXPECT_TRUE(shown_after(workflow, 6).overlaid);
}

}  // namespace
}  // namespace birdseye::host
