// Each step of the operation alone: what it makes of the values that it is given.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "drivers/system/wait.hpp"
#include "host/operation/calibration_step.hpp"
#include "host/operation/connection_step.hpp"
#include "host/operation/deformation_step.hpp"
#include "host/operation/fiducial_step.hpp"
#include "host/operation/landmark_check.hpp"
#include "host/operation/organ_strokes.hpp"
#include "host/operation/patient_step.hpp"
#include "host/operation/pointer_tip.hpp"
#include "host/operation/view_step.hpp"
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

TEST(CalibrationStep, GuidesOnlyOverABoard) {
  CalibrationStep step;
  step.begin("scope", std::nullopt);
  EXPECT_FALSE(step.guiding());
  EXPECT_FALSE(step.withdraw_record("the tracker is another"));
  EXPECT_EQ(step.note().line, "the tracker is another");
  step.begin("scope", *calibration::parse_pattern("chessboard:14x9:3mm"));
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
  step.begin("scope", *board);
  const CalibratedScope kept = kept_scope();
  step.take_up(kept, "taken up");
  EXPECT_FALSE(step.guiding());
  EXPECT_FALSE(step.guide().has_value());
  EXPECT_FALSE(step.tick({}));
  EXPECT_EQ(step.note().line, "taken up");
  step.begin("scope", *board);
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
  step.confirm();
  EXPECT_TRUE(step.confirmed());
  FiducialStep fitted;
  for (const Eigen::Vector3d& fiducial : kFiducials) fitted.add(touch_at(fiducial), 0, {});
  fitted.fit(kFiducials, 0, nullptr);
  EXPECT_FALSE(fitted.take_up(kept, "taken up"));
  EXPECT_TRUE(fitted.confirmed());
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

std::optional<wire::VideoFrame> noise(unsigned seed) {
  std::mt19937 random(seed);
  auto rgb = std::make_shared<std::vector<std::uint8_t>>();
  for (int i = 0; i < 3 * 64 * 48; ++i) rgb->push_back(static_cast<std::uint8_t>(60 + random() % 120));
  wire::VideoFrame frame;
  frame.width_px = 64;
  frame.height_px = 48;
  frame.rgb = rgb;
  return frame;
}

const Transform<Camera, Patient> kCameraFromPatient(Eigen::Matrix3d::Identity(), {-12, -12, 60});

/// The camera n steps of 6 mm to the right of there.
Transform<Camera, Patient> beside(unsigned n) {
  return {Eigen::Matrix3d::Identity(), kCameraFromPatient.translation() - Eigen::Vector3d(6.0 * n, 0, 0)};
}

const Setup kSetup = ScopeSetup::of_hand_eye({64, 48, 60, 60, 32, 24}, std::nullopt, {})
                         .registered(Transform<Tracker, Patient>(Eigen::Matrix3d::Identity(), {300, 0, 0}));

TEST(ViewStep, KeepsOnlyFramesWithAnOverlay) {
  ViewStep step;
  step.keep(noise(1), std::nullopt, kSetup);
  EXPECT_TRUE(step.views().empty());
  EXPECT_EQ(step.note().line.substr(0, 9), "not kept:");
  for (unsigned i = 0; i < 5; ++i) step.keep(noise(i), beside(i), kSetup);
  EXPECT_TRUE(step.note().done);
  step.undo();
  EXPECT_FALSE(step.note().done);
  EXPECT_EQ(step.note().line, "4 views kept");
  step.forget("calibrated anew");
  EXPECT_TRUE(step.views().empty());
  EXPECT_EQ(step.note().line, "calibrated anew");
}

TEST(ViewStep, OneMoreThanTheMostIsRefusedAndToldSo) {
  ViewStep step;
  for (unsigned i = 0; i < 12; ++i) step.keep(noise(i), beside(i), kSetup);
  EXPECT_EQ(step.note().line, "12 views kept");
  step.keep(noise(12), beside(12), kSetup);
  EXPECT_EQ(step.views().size(), 12U);
  EXPECT_EQ(step.note().line, "not kept: 12 views are the most; undo the last one, or go on");
  EXPECT_TRUE(step.note().done);
  step.undo();
  step.keep(noise(12), beside(12), kSetup);
  EXPECT_EQ(step.note().line, "12 views kept");
}

TEST(ViewStep, AViewFromWhereOneWasKeptIsRefused) {
  ViewStep step;
  step.keep(noise(1), beside(0), kSetup);
  step.keep(noise(2), beside(1), kSetup);
  const Transform<Camera, Patient> near(Eigen::Matrix3d::Identity(),
                                        beside(1).translation() + Eigen::Vector3d(0, 2, -3));
  step.keep(noise(3), near, kSetup);
  EXPECT_EQ(step.views().size(), 2U);
  EXPECT_EQ(step.note().line, "not kept: view 2 was kept from here: move the scope by 5 mm or more");
  // From there it sees another part of the organ.
  const Transform<Camera, Camera> turned(rotation_exp(Eigen::Vector3d(0, 0.6, 0)), Eigen::Vector3d::Zero());
  step.keep(noise(4), turned * near, kSetup);
  EXPECT_EQ(step.note().line, "3 views kept");
}

TEST(ViewStep, AveragesTheTrackersNoiseAboutAKeptFrame) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise_mm(0, 0.5);
  // 100 measurements a second while the scope moves by 30 mm/s; the frame is of the middle.
  const auto truth = [](int i) {
    return Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), {250 + 0.3 * (i - 100), 0, -80});
  };
  const auto measured = [&](int i) {
    const Eigen::Vector3d off(noise_mm(random), noise_mm(random), noise_mm(random));
    return Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), truth(i).translation() + off);
  };
  const auto time = [](int i) { return DeviceTime{} + Duration::from_ms(10 * std::int64_t{i}); };
  double before_mm2 = 0, after_mm2 = 0;
  for (int trial = 0; trial < 40; ++trial) {
    ViewStep step;
    for (int i = 0; i <= 103; ++i) {
      const auto pose = measured(i);
      step.take(time(i), pose);
      if (i != 100) continue;
      wire::VideoFrame frame = *noise(1);
      frame.info.acquired = time(i);
      step.keep(frame, kSetup.camera_from_patient(pose), kSetup);
      before_mm2 += (pose.translation() - truth(i).translation()).squaredNorm();
    }
    const auto given = step.views().front().camera_from_patient;
    step.average(kSetup);
    EXPECT_EQ(step.views().front().camera_from_patient.matrix(), given.matrix()) << "what comes after it is missing";
    for (int i = 104; i <= 120; ++i) step.take(time(i), measured(i));
    step.average(kSetup);
    const Eigen::Vector3d is = step.views().front().camera_from_patient.translation();
    after_mm2 += (is - kSetup.camera_from_patient(truth(100)).translation()).squaredNorm();
    EXPECT_NE(is, given.translation());
  }
  // Thirteen measurements, of which a line takes its value in the middle: a share of 1 / sqrt(13).
  EXPECT_NEAR(std::sqrt(after_mm2 / before_mm2), 0.28, 0.08);
}

TEST(ViewStep, OfAScopeThatMovesFastIsRefused) {
  const auto time = [](int i) { return DeviceTime{} + Duration::from_ms(10 * std::int64_t{i}); };
  const auto note_of = [&](double mm_per_s, double deg_per_s) {
    ViewStep step;
    Transform<Tracker, Sensor> pose;
    for (int i = 0; i <= 100; ++i) {
      const double since_s = 0.01 * i;
      pose = Transform<Tracker, Sensor>(rotation_exp(Eigen::Vector3d(0, 0, deg_per_s * kRadPerDeg * since_s)),
                                        Eigen::Vector3d(mm_per_s * since_s, 0, 0));
      step.take(time(i), pose);
    }
    wire::VideoFrame frame = *noise(1);
    frame.info.acquired = time(90);
    step.keep(frame, kSetup.camera_from_patient(pose), kSetup);
    return step.note().line;
  };
  EXPECT_EQ(note_of(0, 0), "1 views kept");
  EXPECT_EQ(note_of(35, 25), "1 views kept");
  EXPECT_EQ(note_of(45, 0), "not kept: the scope moves: hold it still");
  EXPECT_EQ(note_of(0, 35), "not kept: the scope moves: hold it still");
}

TEST(ViewStep, TakenAsTheScopeBeganToMoveIsLetGo) {
  const auto time = [](int i) { return DeviceTime{} + Duration::from_ms(10 * std::int64_t{i}); };
  const auto pose = [](int i) {
    return Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), {1.0 * std::max(0, i - 100), 0, 0});
  };
  ViewStep step;
  for (int i = 0; i <= 100; ++i) step.take(time(i), pose(i));
  wire::VideoFrame frame = *noise(1);
  frame.info.acquired = time(100);
  step.keep(frame, kSetup.camera_from_patient(pose(100)), kSetup);
  EXPECT_EQ(step.note().line, "1 views kept");
  for (int i = 101; i <= 110; ++i) step.take(time(i), pose(i));
  step.average(kSetup);
  EXPECT_TRUE(step.views().empty());
  EXPECT_EQ(step.note().line, "not kept: the scope moves: hold it still");
}

/// As of an appliance that was started anew: a measurement of before has no say in a frame of now.
TEST(ViewStep, AClockThatWentBackAveragesNothingOfBefore) {
  const Transform<Tracker, Sensor> before(Eigen::Matrix3d::Identity(), {200, 0, 0});
  const Transform<Tracker, Sensor> now(Eigen::Matrix3d::Identity(), {260, 0, 0});
  ViewStep step;
  for (int i = 0; i < 200; ++i) step.take(DeviceTime{} + Duration::from_ms(10 * std::int64_t{i}), before);
  wire::VideoFrame frame = *noise(1);
  frame.info.acquired = DeviceTime{} + Duration::from_ms(500);
  for (int i = 40; i < 60; ++i) step.take(DeviceTime{} + Duration::from_ms(10 * std::int64_t{i}), now);
  step.keep(frame, kSetup.camera_from_patient(now), kSetup);
  step.average(kSetup);
  const Eigen::Vector3d off_mm =
      step.views().front().camera_from_patient.translation() - kSetup.camera_from_patient(now).translation();
  EXPECT_LT(off_mm.norm(), 1e-9);
}

std::shared_ptr<const PatientPlan> ball() {
  auto plan = std::make_shared<PatientPlan>();
  Volume& ct = plan->ct;
  ct.size = {24, 24, 24};
  for (int k = 0; k < 24; ++k) {
    for (int j = 0; j < 24; ++j) {
      for (int i = 0; i < 24; ++i)
        ct.hu.push_back((Eigen::Vector3d(i, j, k) - Eigen::Vector3d(12, 12, 12)).norm() < 8 ? 100 : -1000);
    }
  }
  return plan;
}

/// The patient may be replaced while it runs: the thread keeps what it was given.
TEST(DeformationStep, NeedsNothingOfItsCallerWhileItRuns) {
  const auto transfer = std::make_shared<const TransferFunction>(*load_transfer_function("abdomen"));
  std::weak_ptr<const PatientPlan> watched;
  DeformationStep step;
  {
    ViewStep views;
    for (unsigned i = 0; i < 2; ++i) views.keep(noise(i), beside(i), kSetup);
    const auto plan = ball();
    watched = plan;
    step.begin(views.views(), {64, 48, 60, 60, 32, 24}, plan, transfer);
  }
  EXPECT_EQ(step.note().line, "matching");
  EXPECT_FALSE(step.forget()) << "there was none before";
  EXPECT_EQ(step.note().line, "");
  for (int i = 0; i < 2000 && step.running(); ++i) sleep_for(Duration::from_ms(10));
  ASSERT_FALSE(step.running());
  EXPECT_FALSE(step.tick()) << "what is forgotten is not found";
  EXPECT_EQ(step.found(), nullptr);
  EXPECT_EQ(step.note().line, "");
  step.begin({}, {}, ball(), transfer);
  EXPECT_EQ(step.note().line, "0 views are too few: keep 5 or more, from different sides");
}

/// Round the side of the ball that no view sees, and off it by so much.
std::vector<SeenPoint> strokes_round_the_ball(double off_mm) {
  OrganStrokes strokes;
  strokes.begin(1);
  for (int i = 0; i < 400; ++i) {
    const double around = 0.08 * i, down = i < 200 ? 0.3 : 0.9;
    const Eigen::Vector3d outward(std::cos(down) * std::cos(around), std::cos(down) * std::sin(around), std::sin(down));
    strokes.take(DeviceTime{(5000 + 10 * i) * kMs}, Eigen::Vector3d::Constant(12) + (8 + off_mm) * outward);
  }
  return strokes.touches(0.3);
}

TEST(DeformationStep, IsFoundByTouchesBesideASingleView) {
  const auto transfer = std::make_shared<const TransferFunction>(*load_transfer_function("abdomen"));
  const CameraModel camera{64, 48, 60, 60, 32, 24};
  ViewStep views;
  views.keep(noise(1), kCameraFromPatient, kSetup);
  DeformationStep step;
  step.begin(views.views(), camera, ball(), transfer);
  EXPECT_FALSE(step.running());
  EXPECT_EQ(step.note().line, "1 views are too few: keep 5 or more, from different sides");
  step.begin(views.views(), camera, ball(), transfer, strokes_round_the_ball(0.5));
  for (int i = 0; i < 6000 && step.running(); ++i) sleep_for(Duration::from_ms(10));
  ASSERT_FALSE(step.running());
  (void)step.tick();
  EXPECT_NE(step.note().line.find(" touched patches none is thought wrong"), std::string::npos) << step.note().line;
}

TEST(DeformationStep, WhatIsTakenUpCanBeUndone) {
  DeformationStep step;
  step.take_up(std::make_shared<const DeformedOrgan>(), "taken up");
  EXPECT_TRUE(step.note().done);
  step.undo();
  EXPECT_EQ(step.found(), nullptr);
  EXPECT_FALSE(step.note().done);
  step.take_up(std::make_shared<const DeformedOrgan>(), "taken up");
  EXPECT_TRUE(step.forget());
  EXPECT_FALSE(step.forget());
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
