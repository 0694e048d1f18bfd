// Views that are kept, and the deformation that is found by them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "drivers/system/wait.hpp"
#include "host/operation/deformation_step.hpp"
#include "host/operation/organ_strokes.hpp"
#include "host/operation/view_step.hpp"
#include "tests/support/live_operation.hpp"

namespace birdseye::host {
namespace {

using birdseye::testing::kMs;

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

TEST(DeformationStep, WhatWasFoundWithCareIsTakenUpWithCare) {
  DeformedOrgan found;
  found.care = "the target may be off by 4.1 mm";
  DeformationStep step;
  step.take_up(std::make_shared<const DeformedOrgan>(found), "taken up");
  EXPECT_TRUE(step.with_care());
  EXPECT_EQ(step.note().line, "taken up, with care: the target may be off by 4.1 mm");
  step.undo();
  EXPECT_FALSE(step.with_care());
  step.take_up(std::make_shared<const DeformedOrgan>(), "taken up");
  EXPECT_FALSE(step.with_care());
}

}  // namespace
}  // namespace birdseye::host
