#include "host/overlay/gate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

namespace birdseye::host {
namespace {

const TrustFigures kGood{{0.3, 2, 1}, 0.5, 2};

PoseAnswer sound() {
  PoseAnswer pose;
  pose.kind = PoseKind::interpolated;
  pose.tracker_from_sensor = Transform<Tracker, Sensor>();
  pose.position_sigma_mm = 0.1;
  return pose;
}

TEST(OverlayGate, DrawsWithASoundPoseAndNeverWithout) {
  OverlayGate gate;
  gate.set_figures(kGood);
  EXPECT_EQ(gate.decide({0}, sound()).strength, 1);
  PoseAnswer none;
  none.reason = "the newest pose is 300 ms old";
  const auto refused = gate.decide({40'000'000}, none);
  EXPECT_EQ(refused.strength, 0);
  EXPECT_EQ(refused.reason, none.reason);
}

TEST(OverlayGate, DrawsNothingOverABadCalibration) {
  OverlayGate gate;
  TrustFigures figures = kGood;
  figures.fre_mm = 9;
  gate.set_figures(figures);
  const auto decision = gate.decide({0}, sound());
  EXPECT_EQ(decision.strength, 0);
  EXPECT_NE(decision.reason.find("9.0 mm"), std::string::npos);
  gate.set_figures(kGood);
  EXPECT_EQ(gate.decide({1'000'000'000}, sound()).strength, 1);
}

TEST(OverlayGate, WhatTheVideoDoesNotShowIsNotDrawn) {
  TrustFigures figures = kGood;
  for (const auto& [video, strength] : {std::pair{VideoAgreement::untold, 0.0},
                                        {VideoAgreement::in_doubt, 0.0},
                                        {VideoAgreement::differs, 0.0},
                                        {VideoAgreement::agrees, 1.0}}) {
    figures.video = video;
    OverlayGate gate;
    gate.set_figures(figures);
    const auto decision = gate.decide({0}, sound());
    EXPECT_EQ(decision.strength, strength);
    EXPECT_EQ(decision.believed, strength > 0) << "nor is a view kept by it";
    EXPECT_EQ(decision.reason.empty(), strength > 0);
  }
}

TEST(OverlayGate, FiducialsThatLeaveTheTargetOpenAreNotDrawnBy) {
  TrustFigures figures = kGood;
  figures.target_mm = 9;
  OverlayGate gate;
  gate.set_figures(figures);
  const auto decision = gate.decide({0}, sound());
  EXPECT_EQ(decision.strength, 0);
  EXPECT_NE(decision.reason.find("leave the target open by 9 mm"), std::string::npos) << decision.reason;
}

TEST(OverlayGate, AllThatAddsToTheTargetsErrorCounts) {
  OverlayGate gate;
  gate.set_figures(kGood);
  ErrorBudget budget;
  budget.fiducials_mm = budget.hand_eye_mm = budget.pose_mm = budget.time_mm = 3.9;
  EXPECT_EQ(gate.decide({0}, sound(), budget).strength, 1) << "7.8 mm in all";
  budget.motion = MotionError{3, 6};
  const auto decision = gate.decide({1'000'000'000}, sound(), budget);
  EXPECT_EQ(decision.strength, 0);
  EXPECT_EQ(decision.reason, "the target may be off by 8 mm, by all that is counted");
  ASSERT_TRUE(decision.expected.has_value());
}

TEST(OverlayGate, NobodyAnswersForARodWhoseAngleIsNotKnown) {
  TrustFigures figures = vouched_for(kGood);
  figures.scope.rod_angle_missing = true;
  OverlayGate gate;
  gate.set_figures(vouched_for(figures));
  const auto decision = gate.decide({0}, sound());
  EXPECT_EQ(decision.strength, 0);
  EXPECT_NE(decision.reason.find("--rod-angle"), std::string::npos) << decision.reason;
}

/// Nothing is known before it is measured; and of what is known, each figure is needed.
TEST(OverlayGate, DrawsNothingByAFigureThatIsNotKnown) {
  OverlayGate fresh;
  EXPECT_EQ(fresh.decide({0}, sound()).strength, 0);
  using Change = void (*)(TrustFigures&);
  const std::pair<const char*, Change> unknown[] = {
      {"how well the camera is calibrated", [](TrustFigures& f) { f.scope.camera_rms_px.reset(); }},
      {"how far hand-eye is off", [](TrustFigures& f) { f.scope.held_out_px.reset(); }},
      {"how well the fiducials fit", [](TrustFigures& f) { f.fre_mm.reset(); }},
      {"how far the target may be off", [](TrustFigures& f) { f.target_mm.reset(); }}};
  for (const auto& [words, take_away] : unknown) {
    TrustFigures figures = kGood;
    take_away(figures);
    OverlayGate gate;
    gate.set_figures(figures);
    const auto decision = gate.decide({0}, sound());
    EXPECT_EQ(decision.strength, 0) << words;
    EXPECT_EQ(decision.reason, words + std::string(" is not known"));
    OverlayGate vouched;
    vouched.set_figures(vouched_for(figures));
    EXPECT_EQ(vouched.decide({0}, sound()).strength, 1) << words;
  }
  EXPECT_EQ(decide_still({}).strength, 0);
  EXPECT_EQ(decide_still(vouched_for({})).strength, 1);
  TrustFigures bad;
  bad.fre_mm = 9;
  EXPECT_EQ(decide_still(vouched_for(bad)).strength, 0) << "what is stated is judged";
}

TEST(OverlayGate, DrawsNothingOverAnOrganThatMovedThoughThePoseIsBelieved) {
  TrustFigures figures = kGood;
  figures.moved_mm = 6;
  OverlayGate gate;
  gate.set_figures(figures);
  const auto moved = gate.decide({0}, sound());
  EXPECT_EQ(moved.strength, 0);
  EXPECT_EQ(moved.reason, "the organ has moved since the views (6 mm): keep views anew (or undo the deformation)");
  EXPECT_TRUE(moved.believed);
  EXPECT_FALSE(gate.decide({40'000'000}, PoseAnswer{}).believed);
}

TEST(OverlayGate, FadesWhilePosesAreDoubtfulAndSaysWhy) {
  OverlayGate gate;
  gate.set_figures(kGood);
  gate.decide({0}, sound());
  PoseAnswer shaky = sound();
  shaky.position_sigma_mm = 5;
  const auto first = gate.decide({40'000'000}, shaky);
  EXPECT_NEAR(first.strength, 0.8, 1e-9);
  EXPECT_NE(first.reason.find("scatters by 5.0 mm"), std::string::npos);
  for (int i = 2; i < 6; ++i) gate.decide({i * 40'000'000}, shaky);
  EXPECT_EQ(gate.decide({240'000'000}, shaky).strength, 0);
  EXPECT_NEAR(gate.decide({280'000'000}, sound()).strength, 0.2, 1e-9);
  PoseAnswer ahead = sound();
  ahead.kind = PoseKind::predicted;
  ahead.age = Duration::from_ms(70);
  EXPECT_NE(gate.decide({320'000'000}, ahead).reason.find("70 ms"), std::string::npos);
  shaky.position_sigma_mm = NAN;
  EXPECT_FALSE(gate.decide({360'000'000}, shaky).reason.empty());
}

}  // namespace
}  // namespace birdseye::host
