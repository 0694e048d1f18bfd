// Each step of the operation alone: what it makes of the values that it is given.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/operation/calibration_step.hpp"
#include "host/operation/connection_step.hpp"
#include "host/operation/fiducial_step.hpp"
#include "host/operation/landmark_check.hpp"
#include "host/operation/patient_step.hpp"
#include "host/operation/pointer_tip.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::example_record;
using birdseye::testing::kFiducials;
using birdseye::testing::kMs;
using birdseye::testing::kTrackerFromPatient;
using birdseye::testing::Scratch;

TEST(ConnectionStep, IsDoneWhileTheApplianceIsReady) {
  ConnectionStep step;
  step.set_link(true, "connected", false);
  EXPECT_FALSE(step.note().done);
  wire::Health health;
  health.state = "starting";
  step.take(health);
  step.set_link(true, "connected", true);
  EXPECT_FALSE(step.note().done);
  EXPECT_EQ(step.note().line, "the appliance is starting");
  health.state = "ready";
  step.take(health);
  step.set_link(true, "connected", false);
  EXPECT_TRUE(step.note().done);
  step.set_link(false, "gone", false);
  EXPECT_FALSE(step.link().health.has_value());
}

TEST(ConnectionStep, WhatTheApplianceNotesWhereNothingIsAmissIsKeptAndStopsNothing) {
  ConnectionStep step;
  step.take(wire::Status{false, "no tracker; UNSIGNED: a map"});
  EXPECT_EQ(step.link().appliance_says, "no tracker; UNSIGNED: a map");
  EXPECT_EQ(step.link().appliance_notes, "");
  step.take(wire::Status{true, "UNSIGNED: a map"});
  step.set_link(true, "connected", true);
  EXPECT_TRUE(step.note().done);
  EXPECT_EQ(step.link().appliance_says, "");
  EXPECT_EQ(step.link().appliance_notes, "UNSIGNED: a map");
  step.set_link(false, "gone", false);
  EXPECT_EQ(step.link().appliance_notes, "");
}

/// As a window kept it, made at 9:35.
CalibratedScope kept_scope() {
  calibration::HandEyeResult found;
  found.held_out_px = 1;
  return {ScopeSetup::of_hand_eye({768, 576, 500, 500, 384, 288}, 0.3, found), "2026-11-22T09:35:00Z", true};
}

TEST(CalibrationStep, OfTwoCalibrationsTheNewerCounts) {
  CalibrationStep step;
  auto record = example_record(768, 576, {}, {});
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::again) << "there was none before it";
  EXPECT_EQ(step.found()->scope.figures().held_out_px, 1.75);
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::again);
  record.hand_eye->provenance.made_utc = "2026-11-22T09:40:00Z";
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::anew);
  const CalibratedScope older = kept_scope();
  step.take_up(older, "taken up");
  EXPECT_FALSE(step.found()->by_board);
  CalibratedScope newer = older;
  newer.made_utc = "2026-11-22T09:50:00Z";
  step.take_up(newer, "taken up");
  EXPECT_TRUE(step.found()->by_board);
  EXPECT_EQ(step.note().line, "taken up");
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::no);
  record.lens.reset();
  EXPECT_EQ(CalibrationStep().adopt(record), CalibrationStep::Adopted::no);
}

/// The tip is the registration's: the scope, and how its rod is turned, are as they were.
TEST(CalibrationStep, ARecordOfAnotherTipIsOfNoOtherScope) {
  CalibrationStep step;
  auto record = example_record(768, 576, {}, {});
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::again) << "there was none before it";
  record.tip->tip_in_sensor_mm.z() += 1;
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::again);
  record.tip.reset();
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::again);
}

/// The appliance tells that the scope was exchanged since the board was used.
TEST(CalibrationStep, ARecordOfAnotherScopeCountsThoughTheBoardWasUsedLater) {
  for (const bool record_first : {true, false}) {
    CalibrationStep step;
    auto record = example_record(768, 576, {}, {});
    CalibratedScope board = kept_scope();
    board.made_utc = "2026-11-22T09:50:00Z";
    board.record_scope = "scope no. 17";
    record.scope = record_first ? "scope no. 18" : "scope no. 17";
    if (record_first) {
      EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::again);
      EXPECT_FALSE(step.take_up(board, "taken up"));
    } else {
      EXPECT_TRUE(step.take_up(board, "taken up"));
      EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::no) << "it is of the same scope, and older";
      record.scope = "scope no. 18";
      EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::anew);
    }
    EXPECT_FALSE(step.found()->by_board);
  }
}

TEST(CalibrationStep, ARecordThatWasWithdrawnTellsNoScope) {
  CalibrationStep step;
  auto record = example_record(768, 576, {}, {});
  record.scope = "scope no. 18";
  EXPECT_EQ(step.adopt(record), CalibrationStep::Adopted::again);
  EXPECT_TRUE(step.withdraw_record("it was taken away"));
  CalibratedScope board = kept_scope();
  board.made_utc = "2026-11-22T09:50:00Z";
  board.record_scope = "scope no. 17";
  EXPECT_TRUE(step.take_up(board, "taken up")) << "nothing says that the scope is no. 18";
}

TEST(CalibrationStep, GuidesOnlyOverABoard) {
  CalibrationStep step;
  step.begin("scope", std::nullopt, {});
  EXPECT_FALSE(step.guiding());
  EXPECT_FALSE(step.withdraw_record("the tracker is another"));
  EXPECT_EQ(step.note().line, "the tracker is another");
  step.begin("scope", *calibration::parse_pattern("chessboard:14x9:3mm"), {});
  EXPECT_TRUE(step.guiding());
  step.end();
  for (int i = 0; i < 1000 && step.guiding(); ++i) {
    sleep_for(Duration::from_ms(10));
    EXPECT_FALSE(step.tick({})) << "no station, no calibration";
  }
  EXPECT_FALSE(step.guiding());
  EXPECT_FALSE(step.found().has_value());
}

TEST(CalibrationStep, WhatIsTakenUpGivesUpTheGuideAndItMayBeginAgain) {
  const auto board = calibration::parse_pattern("chessboard:14x9:3mm");
  CalibrationStep step;
  step.begin("scope", *board, {});
  const CalibratedScope kept = kept_scope();
  step.take_up(kept, "taken up");
  EXPECT_FALSE(step.guiding());
  EXPECT_FALSE(step.guide().has_value());
  EXPECT_FALSE(step.tick({}));
  EXPECT_EQ(step.note().line, "taken up");
  step.begin("scope", *board, {});
  ASSERT_TRUE(step.guiding());
  EXPECT_TRUE(step.guide()->collecting);
  step.end();
  for (int i = 0; i < 1000 && step.guiding(); ++i) {
    sleep_for(Duration::from_ms(10));
    EXPECT_FALSE(step.tick({}));
  }
  EXPECT_FALSE(step.guiding());
  EXPECT_EQ(step.found()->made_utc, kept.made_utc) << "no station, and what there was still holds";
}

TEST(PatientStep, OfTwoPatientsTheSecondIsRead) {
  const Scratch first, second;
  PatientFiles files, others;
  files.ct = birdseye::testing::small_ct(first);
  others.ct = birdseye::testing::small_ct(second, 11);
  PatientStep step("tumour-and-vessels", "cpu");
  step.load(files);
  step.load(others);  // while the first is read
  for (int i = 0; i < 1000 && !step.plan() && step.fault().empty(); ++i) {
    sleep_for(Duration::from_ms(10));
    step.tick();
  }
  ASSERT_TRUE(step.plan()) << step.fault();
  EXPECT_EQ(step.plan()->ct_sha256, read_patient(others)->ct_sha256);
  EXPECT_NE(step.plan()->ct_sha256, read_patient(files)->ct_sha256);
}

Touch touch_at(const Eigen::Vector3d& in_patient_mm) {
  return {kTrackerFromPatient * in_patient_mm, 0.1, 30};
}

TEST(FiducialStep, FitsWhatIsTouchedOnceTheMarkersAreKnown) {
  FiducialStep step;
  for (const Eigen::Vector3d& fiducial : kFiducials) {
    EXPECT_TRUE(step.add(touch_at(fiducial), 4, {}));
    step.fit(std::nullopt, 4, nullptr);
  }
  EXPECT_FALSE(step.add(touch_at(Eigen::Vector3d::Zero()), 4, {})) << "all are touched";
  EXPECT_FALSE(step.registered().has_value());
  EXPECT_EQ(step.note().line, "4 touched");
  step.fit(kFiducials, 4, nullptr);
  ASSERT_TRUE(step.registered().has_value()) << step.fault();
  EXPECT_TRUE(step.note().done);
  EXPECT_LT(*step.touches()[2].residual_mm, 1e-6);
  EXPECT_TRUE(step.take_back(3));
  step.fit(kFiducials, 4, nullptr);
  EXPECT_TRUE(step.registered().has_value());
  EXPECT_FALSE(step.note().done) << "three leave open which is which";
}

/// Once: a video that contradicts again and again would else let nobody register.
TEST(FiducialStep, ATouchSinceSomethingSpokeAgainstTheFormerBeginsAnewOnce) {
  FiducialStep step;
  step.add(touch_at(kFiducials[0]), 4, {});
  step.add(touch_at(kFiducials[1]), 4, {});
  EXPECT_FALSE(step.begins_anew());
  step.suspect();
  EXPECT_TRUE(step.begins_anew());
  EXPECT_TRUE(step.add(touch_at(kFiducials[2]), 4, {}));
  EXPECT_FALSE(step.begins_anew());
  step.fit(kFiducials, 4, nullptr);
  EXPECT_EQ(step.touches().size(), 1U);
  EXPECT_EQ(step.note().line, "1 touched anew, dropped from before: 2");
  EXPECT_TRUE(step.suspected()) << "the video has not been seen to agree since";
  step.suspect();
  step.add(touch_at(kFiducials[3]), 4, {});
  EXPECT_EQ(step.touches().size(), 2U);
}

/// Nothing is left then that could be of another setup.
TEST(FiducialStep, WhereAllTouchesWereTakenBackNothingIsSuspectedOfTheNext) {
  FiducialStep step;
  step.add(touch_at(kFiducials[0]), 4, {});
  step.suspect();
  EXPECT_TRUE(step.take_back(0));
  step.fit(kFiducials, 4, nullptr);
  step.add(touch_at(kFiducials[0]), 4, {});
  EXPECT_FALSE(step.suspected());
}

TEST(FiducialStep, WhereAllWereTouchedAndSomethingSpokeAgainstThemANewTouchBeginsAnew) {
  FiducialStep step;
  for (const Eigen::Vector3d& fiducial : kFiducials) step.add(touch_at(fiducial), 4, {});
  step.fit(kFiducials, 4, nullptr);
  ASSERT_TRUE(step.registered().has_value());
  step.suspect();
  EXPECT_TRUE(step.add(touch_at(kFiducials[0]), 4, {}));
  step.fit(kFiducials, 4, nullptr);
  EXPECT_EQ(step.touches().size(), 1U);
  EXPECT_FALSE(step.registered().has_value());
}

/// Markers about an organ, and touches of them; one is off.
FiducialStep touched_with_one_off(const std::vector<Eigen::Vector3d>& markers, std::size_t which,
                                  const Eigen::Vector3d& off_mm) {
  FiducialStep step;
  for (std::size_t i = 0; i < markers.size(); ++i)
    step.add(touch_at(markers[i] + (i == which ? off_mm : Eigen::Vector3d::Zero())), markers.size(), {});
  step.fit(markers, markers.size(), nullptr);
  return step;
}

TEST(FiducialStep, NamesTheTouchThatIsOff) {
  std::vector<Eigen::Vector3d> five = kFiducials;
  five.emplace_back(-9, -53, -55);  // no four of them are like four others
  for (std::size_t which = 0; which < five.size(); ++which) {
    FiducialStep step = touched_with_one_off(five, which, {6, -7, 8});
    EXPECT_TRUE(step.fits_poorly());
    ASSERT_EQ(step.odd(), which);
    ASSERT_TRUE(step.take_back(which));
    step.fit(five, five.size(), nullptr);
    EXPECT_FALSE(step.fits_poorly());
    EXPECT_FALSE(step.odd().has_value());
    EXPECT_LT(step.registered()->fre_mm, 1e-6);
    EXPECT_EQ(step.touches().size(), 4U);
  }
  // So far off that nothing fits at all.
  const FiducialStep far_off = touched_with_one_off(five, 2, {0, 0, 90});
  EXPECT_FALSE(far_off.registered().has_value());
  EXPECT_EQ(far_off.odd(), 2U);
  EXPECT_FALSE(FiducialStep().take_back(0));
}

TEST(FiducialStep, OfFlatMarkersItAsksForOneMoreOffTheirPlane) {
  std::vector<Eigen::Vector3d> markers{{0, 0, 0}, {90, 5, 1}, {20, 70, 0}, {85, 100, 2}};
  const auto touch_four = [&] {
    FiducialStep step;
    for (std::size_t i = 0; i < 4; ++i) step.add(touch_at(markers[i] + Eigen::Vector3d(0, 0, i == 2 ? 0.8 : 0)), 4, {});
    step.fit(markers, 4, nullptr);
    return step;
  };
  FiducialStep step = touch_four();
  EXPECT_TRUE(step.registered().has_value());
  EXPECT_FALSE(step.fits());
  EXPECT_NE(step.note().line.find("touch one more, off their plane"), std::string::npos) << step.note().line;
  EXPECT_FALSE(step.add(touch_at({30, 30, 60}), 4, {})) << "the CT has no more";
  markers.emplace_back(30, 30, 60);
  step = touch_four();
  ASSERT_TRUE(step.add(touch_at(markers.back()), 4, {}));
  step.fit(markers, 4, nullptr);
  EXPECT_TRUE(step.fits()) << step.note().line;
  EXPECT_FALSE(step.add(touch_at({30, 30, 60}), 4, {})) << "all are touched";
}

TEST(FiducialStep, WhatIsMirroredIsNotRegistered) {
  FiducialStep step;
  for (const Eigen::Vector3d& fiducial : kFiducials)
    step.add(touch_at({-fiducial.x(), fiducial.y(), fiducial.z()}), 4, {});
  step.fit(kFiducials, 4, nullptr);
  EXPECT_FALSE(step.registered().has_value());
  EXPECT_FALSE(step.fits());
  EXPECT_NE(step.fault().find("mirror image"), std::string::npos) << step.fault();
  EXPECT_FALSE(step.fits_poorly()) << "no touch is to blame";
}

TEST(FiducialStep, WhereItCannotBeToldWhichTouchIsOffItNamesNone) {
  const FiducialStep good = touched_with_one_off(kFiducials, 1, {0.3, 0, 0});
  EXPECT_FALSE(good.fits_poorly());
  EXPECT_FALSE(good.odd().has_value());
  // In a plane, and one lifted off it: what is left of any three fits as well.
  const FiducialStep flat = touched_with_one_off({{0, 0, 0}, {90, 5, 0}, {20, 70, 0}, {85, 100, 0}}, 2, {0, 0, 14});
  EXPECT_TRUE(flat.fits_poorly());
  EXPECT_FALSE(flat.odd().has_value());
}

TEST(FiducialStep, WhatIsTakenUpIsNotConfirmedAndDoesNotReplaceAFit) {
  const RegisteredPatient kept{kTrackerFromPatient, 0.3, kFiducials};
  FiducialStep step;
  EXPECT_TRUE(step.add(touch_at(kFiducials[0]), 0, {}));
  EXPECT_TRUE(step.take_up(kept, "taken up"));
  EXPECT_TRUE(step.touches().empty());
  EXPECT_FALSE(step.confirmed());
  EXPECT_EQ(step.note().line, "taken up, FRE 0.30 mm");
  EXPECT_FALSE(step.fits_poorly());
  step.confirm();
  EXPECT_TRUE(step.confirmed());
  FiducialStep fitted;
  for (const Eigen::Vector3d& fiducial : kFiducials) fitted.add(touch_at(fiducial), 0, {});
  fitted.fit(kFiducials, 0, nullptr);
  EXPECT_FALSE(fitted.take_up(kept, "taken up"));
  EXPECT_TRUE(fitted.confirmed());
  FiducialStep poor;
  EXPECT_TRUE(poor.take_up(RegisteredPatient{kTrackerFromPatient, kGoodFit_mm + 0.1, kFiducials}, "taken up"));
  EXPECT_TRUE(poor.fits_poorly()) << "as it was said when it was found";
}

TEST(PointerTip, TellsARestWhenItEndsAndAtOnceWhereItIsHeld) {
  PointerTip tip;
  std::int64_t ms = 0;
  const auto at = [&](double x_mm, const char* bird = "pointer") {
    const Transform<Tracker, Sensor> pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(x_mm, 0, -150));
    return tip.take({{(ms += 10) * kMs}, {{bird, pose}}}, "pointer", {0, 0, 150});
  };
  EXPECT_FALSE(at(500, "scope").has_value());
  EXPECT_FALSE(tip.in_tracker_mm().has_value());
  for (int i = 0; i < 30; ++i) EXPECT_FALSE(at(300 - 10 * i).has_value());
  for (int i = 0; i < 80; ++i) EXPECT_FALSE(at(0).has_value());
  ASSERT_TRUE(tip.held().has_value());
  EXPECT_LT(tip.held()->tip_in_tracker_mm.norm(), 1e-9);
  std::optional<Touch> rested;
  for (int i = 1; i < 30 && !rested; ++i) rested = at(10 * i);
  ASSERT_TRUE(rested.has_value());
  EXPECT_LT(rested->tip_in_tracker_mm.norm(), 2.5);
}

TEST(LandmarkCheck, NamesTheNearestWhereTheCtIsShown) {
  PatientPlan plan;
  plan.landmarks = {{"tumour", {30, 30, 20}}};
  const RegisteredPatient registered{kTrackerFromPatient, 0.3, kFiducials};
  const auto at = [&](const Eigen::Vector3d& in_patient_mm, const DeformedOrgan* deformed) {
    return check_by_landmarks(kTrackerFromPatient * in_patient_mm, registered, plan.landmarks, kFiducials, deformed);
  };
  EXPECT_EQ(at({30, 30, 22}, nullptr).nearest, "tumour");
  EXPECT_NEAR(at({30, 30, 22}, nullptr).distance_mm, 2, 1e-9);
  EXPECT_FALSE(at({30, 30, 22}, nullptr).fitted);
  EXPECT_EQ(at({59, 5, 0}, nullptr).nearest, "fiducial 2");
  EXPECT_TRUE(at({59, 5, 0}, nullptr).fitted) << "what it was fitted to tells nothing of a registration";
  DeformedOrgan moved;
  moved.field.size = {2, 2, 2};
  moved.field.displacement_mm.assign(8, Eigen::Vector3f(-4, 0, 0));
  moved.field.patient_from_lattice = Eigen::Translation3d(-500, -500, -500) * Eigen::Scaling(1000.0);
  EXPECT_NEAR(at({34, 30, 20}, &moved).distance_mm, 0, 1e-3);
}

}  // namespace
}  // namespace birdseye::host
