// Whose CT it is, before anything is registered with it; and places of the CT that a person points at.
#include <gtest/gtest.h>

#include <sstream>

#include "calibration/detect/pattern.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::connect_and_calibrate;
using birdseye::testing::Hand;
using birdseye::testing::kFiducials;
using birdseye::testing::operation_settings;
using birdseye::testing::read_ct;
using birdseye::testing::Scratch;

/// Reads the CT; nobody has said whose it is.
void touch_all(LiveWorkflow& workflow) {
  read_ct(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  for (const Eigen::Vector3d& fiducial : kFiducials) hand.rest_at(fiducial, 80);
  hand.rest_at({0, 0, 200}, 1);
}

TEST(PatientConfirmed, NothingIsRegisteredBefore) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  touch_all(workflow);
  EXPECT_TRUE(workflow.view().asks_for_patient);
  EXPECT_EQ(workflow.view().touches.size(), kFiducials.size());
  EXPECT_FALSE(workflow.view().fre_mm.has_value());
  EXPECT_FALSE(workflow.picture().setup().has_value());
  EXPECT_EQ(primary_words(workflow.view()), "this is the patient");
  workflow.primary(HostTime{0});  // the pedal
  EXPECT_TRUE(workflow.view().patient_confirmed);
  EXPECT_FALSE(workflow.view().asks_for_patient);
  ASSERT_TRUE(workflow.view().fre_mm.has_value()) << "what was touched before counts";
  EXPECT_TRUE(workflow.picture().setup().has_value());
}

TEST(PatientConfirmed, APressTooManyTakesNoPoint) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  read_ct(workflow);
  connect_and_calibrate(workflow);
  Hand hand(workflow);
  hand.rest_at(kFiducials[0], 30);  // so short that a point is taken by a press alone
  const auto press_after = [&workflow](std::int64_t ms) { workflow.primary(HostTime{ms * birdseye::testing::kMs}); };
  press_after(1600);
  ASSERT_TRUE(workflow.view().patient_confirmed);
  press_after(1600);
  press_after(2500);
  EXPECT_TRUE(workflow.view().touches.empty());
  wire::Pedal pedal;
  pedal.pressed = true;
  workflow.take(pedal, HostTime{2550 * birdseye::testing::kMs}, std::nullopt);
  EXPECT_TRUE(workflow.view().touches.empty()) << "nor by the pedal";
  hand.rest_at(kFiducials[0], 30);
  press_after(2600);
  EXPECT_EQ(workflow.view().touches.size(), 1U);
}

TEST(PatientConfirmed, AnotherSystemMayNameThePatient) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.patient_id = "SIM1";  // as small_ct's files have it
  LiveWorkflow workflow(settings);
  touch_all(workflow);
  EXPECT_TRUE(workflow.view().patient_confirmed);
  EXPECT_TRUE(workflow.picture().setup().has_value());
}

TEST(PatientConfirmed, ASimulatedPatientIsNobodyElse) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.patient_id = "4711";
  LiveWorkflow workflow(settings);
  workflow.set_sheet(*calibration::parse_pattern("chessboard:9x6:5mm"), {0, 0, 150}, 4);
  read_ct(workflow);
  EXPECT_FALSE(workflow.view().patient_confirmed);
  EXPECT_FALSE(workflow.view().patient_fault.empty());
}

TEST(PatientConfirmed, WhatWasCheckedIsNotWhenItIsRegisteredAnew) {
  const Scratch scratch;
  LiveWorkflow workflow(operation_settings(scratch));
  touch_all(workflow);
  workflow.confirm_patient();
  workflow.go_to(LiveStep::check);
  workflow.go_on();
  ASSERT_TRUE(workflow.view().note(LiveStep::check).done);
  ASSERT_TRUE(workflow.view().note(LiveStep::run).done);
  workflow.go_to(LiveStep::fiducials);
  workflow.undo();
  EXPECT_FALSE(workflow.view().note(LiveStep::check).done);
  EXPECT_FALSE(workflow.view().note(LiveStep::run).done);
}

TEST(PatientConfirmed, AnotherPatientsCtIsNotToBeConfirmed) {
  const Scratch scratch;
  LiveSettings settings = operation_settings(scratch);
  settings.patient_id = "4711";
  LiveWorkflow workflow(settings);
  touch_all(workflow);
  EXPECT_NE(workflow.view().patient_fault.find("SIM1"), std::string::npos) << workflow.view().patient_fault;
  EXPECT_NE(workflow.view().patient_fault.find("4711"), std::string::npos);
  EXPECT_EQ(primary_words(workflow.view()), "close, and give the CT of this patient");
  EXPECT_TRUE(workflow.view().touches.empty()) << "nothing is begun with another patient's CT";
  workflow.primary(HostTime{0});
  workflow.confirm_patient();
  EXPECT_FALSE(workflow.view().patient_confirmed);
  EXPECT_FALSE(workflow.picture().setup().has_value());
}

/// Until the search at the place that was pointed at has ended.
void finish_pick(LiveWorkflow& workflow) {
  for (int i = 0; i < 3000 && workflow.view().pick_line.empty(); ++i) {
    sleep_for(Duration::from_ms(10));
    workflow.tick();
  }
}

class Picks : public ::testing::Test {
 protected:
  Picks() {
    birdseye::testing::write_ct_with_markers(scratch_ / "markers", kFiducials);
    LiveSettings settings = operation_settings(scratch_);
    settings.patient.ct = scratch_ / "markers";
    // Of the markers in the CT all but the first are known.
    std::ostringstream some;
    for (std::size_t i = 1; i < kFiducials.size(); ++i) some << kFiducials[i].transpose() << '\n';
    settings.patient.fiducials = scratch_.file("some.txt", some.str());
    workflow_.emplace(settings);
    birdseye::testing::load(*workflow_);
  }
  Scratch scratch_;
  std::optional<LiveWorkflow> workflow_;
};

TEST_F(Picks, ARoughPickBecomesTheMarkersCentre) {
  workflow_->pick(PlacePicks::Kind::fiducial, kFiducials[0] + Eigen::Vector3d(2, -2, 1));
  finish_pick(*workflow_);
  const auto view = workflow_->view();
  ASSERT_EQ(view.markers_in_patient_mm.size(), kFiducials.size()) << view.pick_line;
  EXPECT_LT((view.markers_in_patient_mm.back() - kFiducials[0]).norm(), 0.3);
  EXPECT_NE(view.pick_line.find("3.0 mm from where you pointed"), std::string::npos) << view.pick_line;
}

TEST_F(Picks, OneThatIsThereAlreadyIsNotTakenTwice) {
  workflow_->pick(PlacePicks::Kind::fiducial, kFiducials[2] + Eigen::Vector3d(2, 0, 1));
  finish_pick(*workflow_);
  EXPECT_EQ(workflow_->view().markers_in_patient_mm.size(), kFiducials.size() - 1);
  EXPECT_EQ(workflow_->view().pick_line, "Fiducial 2 is there already.");
}

TEST_F(Picks, WhereThereIsNoneItIsSaid) {
  workflow_->pick(PlacePicks::Kind::fiducial, {-10, -10, 60});
  finish_pick(*workflow_);
  EXPECT_EQ(workflow_->view().markers_in_patient_mm.size(), kFiducials.size() - 1);
  EXPECT_NE(workflow_->view().pick_line.find("no marker within"), std::string::npos) << workflow_->view().pick_line;
}

TEST_F(Picks, ALandmarkIsTheMarkersCentreOrThePlaceItself) {
  const std::size_t before = workflow_->view().landmarks.size();
  workflow_->pick(PlacePicks::Kind::landmark, kFiducials[0] + Eigen::Vector3d(1, 1, 0));
  finish_pick(*workflow_);
  ASSERT_EQ(workflow_->view().landmarks.size(), before + 1);
  EXPECT_LT((workflow_->view().landmarks.back().place_mm - kFiducials[0]).norm(), 0.3);
  const Eigen::Vector3d nothing_there(-10, -10, 60);
  workflow_->pick(PlacePicks::Kind::landmark, nothing_there);
  finish_pick(*workflow_);
  ASSERT_EQ(workflow_->view().landmarks.size(), before + 2);
  EXPECT_EQ(workflow_->view().landmarks.back().place_mm, nothing_there);
  workflow_->go_to(LiveStep::check);
  for (int i = 0; i < 4; ++i) workflow_->undo();
  EXPECT_EQ(workflow_->view().landmarks.size(), before) << "those of the file stay";
}

TEST_F(Picks, AFiducialThatIsNoneIsTakenAway) {
  workflow_->drop_marker(kFiducials[1] + Eigen::Vector3d(3, 0, 0));
  const auto left = workflow_->view().markers_in_patient_mm;
  ASSERT_EQ(left.size(), kFiducials.size() - 2);
  for (const Eigen::Vector3d& marker : left) EXPECT_GT((marker - kFiducials[1]).norm(), 1);
  workflow_->drop_marker({-300, 0, 0});
  EXPECT_EQ(workflow_->view().markers_in_patient_mm.size(), left.size());
  EXPECT_NE(workflow_->view().pick_line.find("No fiducial lies within 10 mm"), std::string::npos);
}

TEST_F(Picks, ThePedalSwitchesTheRunningOverlayOffAndOn) {
  workflow_->go_to(LiveStep::run);
  wire::Pedal pedal;
  pedal.pressed = true;
  workflow_->take(pedal, HostTime{0}, std::nullopt);
  EXPECT_TRUE(workflow_->view().overlay_hidden);
  EXPECT_EQ(primary_words(workflow_->view()), "show the overlay");
  pedal.pressed = false;
  workflow_->take(pedal, HostTime{0}, std::nullopt);
  EXPECT_TRUE(workflow_->view().overlay_hidden) << "letting it go is no press";
  pedal.pressed = true;
  workflow_->take(pedal, HostTime{0}, std::nullopt);
  EXPECT_FALSE(workflow_->view().overlay_hidden);
  // What is frozen bears no overlay to switch off, and is let go first.
  workflow_->freeze_or_let_go();
  workflow_->hide_or_show_overlay();
  workflow_->primary(HostTime{0});
  EXPECT_FALSE(workflow_->view().frozen);
  EXPECT_FALSE(workflow_->view().overlay_hidden);
}

}  // namespace
}  // namespace birdseye::host
