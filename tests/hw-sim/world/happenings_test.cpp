#include "hw-sim/world/happenings.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "tests/support/ball_world.hpp"

namespace birdseye::hw_sim {
namespace {

const testing::BallPatient& patient() {
  static const testing::BallPatient made;
  return made;
}

Fault fault(FaultKind kind, double at_s, std::map<std::string, double, std::less<>> values) {
  Fault out;
  out.kind = kind;
  out.at_s = at_s;
  out.values = std::move(values);
  return out;
}

double apart(const Eigen::Matrix4d& a, const Eigen::Matrix4d& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

Fault bump(double at_s) {
  return fault(FaultKind::transmitter_bumped, at_s, {{"mm", 25}, {"deg", 7}, {"over_s", 0.2}});
}

TEST(Happenings, ABumpedTransmitterChangesAllBirdsAlikeAndNothingThatTheCameraSees) {
  const auto still = patient().world({}, ReferenceOn::patient);
  const auto bumped = patient().world({bump(2)}, ReferenceOn::patient);
  ASSERT_TRUE(still && bumped);
  for (double t = 0; t < still->ends_s(); t += 0.37) {
    const auto relative = [t](const World& w) {
      return (w.tracker_from_reference(t).inverse() * w.tracker_from_sensor(t)).matrix();
    };
    const auto touching = [t](const World& w) {
      return (w.tracker_from_reference(t).inverse() * w.tracker_from_pointer(t)).matrix();
    };
    const auto seen = [t](const World& w) {
      return (w.tracker_from_camera(t).inverse() * w.tracker_from_patient(t)).matrix();
    };
    EXPECT_LT(apart(relative(*still), relative(*bumped)), 1e-10) << t;
    EXPECT_LT(apart(touching(*still), touching(*bumped)), 1e-10) << t;
    EXPECT_LT(apart(seen(*still), seen(*bumped)), 1e-10) << t;
    const double moved = apart(still->tracker_from_sensor(t).matrix(), bumped->tracker_from_sensor(t).matrix());
    if (t < 2) {
      EXPECT_EQ(moved, 0) << t;
    }
    if (t > 2.2) {
      EXPECT_GT(moved, 5) << t;
    }
  }
}

TEST(Happenings, WhatEndsIsAsBefore) {
  Fault lasting = bump(2);
  lasting.for_s = 3;
  const auto still = patient().world({});
  const auto bumped = patient().world({lasting});
  ASSERT_TRUE(still && bumped);
  EXPECT_GT(apart(still->tracker_from_sensor(4).matrix(), bumped->tracker_from_sensor(4).matrix()), 5);
  EXPECT_EQ(apart(still->tracker_from_sensor(6).matrix(), bumped->tracker_from_sensor(6).matrix()), 0);
}

TEST(Happenings, AReferenceGoesWithWhatItIsFixedOn) {
  const Fault tilt = fault(FaultKind::bed_tilted, 2, {{"deg", 8}, {"over_s", 1}});
  const Fault slide = fault(FaultKind::patient_moved, 2, {{"mm", 12}, {"deg", 2}, {"over_s", 1}});
  const Fault slip = fault(FaultKind::reference_moved, 2, {{"mm", 15}, {"deg", 10}, {"over_s", 0.1}});
  const auto relative_moves = [](const Fault& befalls, ReferenceOn on) {
    const auto world = patient().world({befalls}, on);
    EXPECT_TRUE(world) << world.error().what;
    const auto relative = [&](double t) {
      return (world->tracker_from_reference(t).inverse() * world->tracker_from_patient(t)).matrix();
    };
    EXPECT_EQ(apart(relative(0), relative(1.9)), 0);
    return apart(relative(0), relative(9));
  };
  EXPECT_LT(relative_moves(tilt, ReferenceOn::patient), 1e-10);
  EXPECT_LT(relative_moves(tilt, ReferenceOn::table), 1e-10);
  EXPECT_LT(relative_moves(slide, ReferenceOn::patient), 1e-10);
  EXPECT_GT(relative_moves(slide, ReferenceOn::table), 5);
  EXPECT_GT(relative_moves(slip, ReferenceOn::patient), 5);
  const auto tilted = patient().world({tilt});
  EXPECT_GT(apart(tilted->tracker_from_patient(0).matrix(), tilted->tracker_from_patient(9).matrix()), 5);
}

TEST(Happenings, ThePointerTouchesFiducialsAndTheScopeSeesTheLiverWhereTheyHaveGone) {
  const auto world = patient().world({fault(FaultKind::bed_tilted, 0.5, {{"deg", 4}, {"over_s", 1}}), bump(1)});
  ASSERT_TRUE(world) << world.error().what;
  for (const Eigen::Vector3d& fiducial_mm : patient().truth.fiducials_mm) {
    double nearest_mm = 1e9;
    for (double t = 2; t < world->ends_s(); t += 0.05) {
      const Eigen::Vector3d tip_mm = world->tracker_from_pointer(t) * world->tip_in_pointer_mm();
      nearest_mm = std::min(nearest_mm, (tip_mm - world->tracker_from_patient(t) * fiducial_mm).norm());
    }
    EXPECT_LT(nearest_mm, 1e-6);
  }
  const double t = world->ends_s() - 3;
  const auto px =
      project(laparoscope_lens(768, 576), world->tracker_from_camera(t).inverse() * world->tracker_from_patient(t) *
                                              patient().truth.tumour_centre_mm);
  ASSERT_TRUE(px);
  EXPECT_LT((*px - Eigen::Vector2d(384, 288)).norm(), 200);
}

TEST(Happenings, ATurnedScopeTurnsItsCameraAboutItsAxisAndLeavesItsBird) {
  const auto still = patient().world({});
  const auto turned = patient().world({fault(FaultKind::scope_turned, 2, {{"deg", 30}, {"over_s", 0}})});
  ASSERT_TRUE(still && turned);
  EXPECT_EQ(apart(still->tracker_from_sensor(9).matrix(), turned->tracker_from_sensor(9).matrix()), 0);
  const auto turn = turned->tracker_from_camera(9).inverse() * still->tracker_from_camera(9);
  EXPECT_LT(turn.translation().norm(), 1e-9);
  const Eigen::AngleAxisd angle(turn.rotation());
  EXPECT_NEAR(angle.angle(), 30 * kRadPerDeg, 1e-9);
  EXPECT_NEAR(std::abs(angle.axis().z()), 1, 1e-9);
  EXPECT_LT(apart(turned->tracker_from_sensor(9).matrix(),
                  (turned->tracker_from_camera(9) * turned->camera_from_sensor(9)).matrix()),
            1e-9);
}

TEST(Happenings, TheBreathComesAndGoesWithItsPeriod) {
  Fault breath = fault(FaultKind::breathing, 3, {{"mm", 12}, {"period_s", 4}});
  const auto world = patient().world({breath});
  ASSERT_TRUE(world);
  EXPECT_EQ(world->organ(2.9).shift_mm.norm(), 0);
  EXPECT_NEAR(world->organ(5).shift_mm.norm(), 12, 1e-9) << "breathed in";
  EXPECT_LT(world->organ(5).shift_mm.z(), -11) << "towards the feet";
  EXPECT_NEAR(world->organ(7).shift_mm.norm(), 0, 1e-9) << "breathed out";
  EXPECT_NEAR((world->organ(6.2).shift_mm - world->organ(10.2).shift_mm).norm(), 0, 1e-9);
  breath.for_s = 5;
  EXPECT_NEAR(patient().world({breath})->organ(9).shift_mm.norm(), 0, 1e-9) << "held";
}

TEST(Happenings, WhatTakesABirdOutOfRangeIsRefused) {
  const auto world =
      patient().world({fault(FaultKind::transmitter_bumped, 2, {{"mm", 300}, {"deg", 80}, {"over_s", 0}})});
  ASSERT_FALSE(world);
  EXPECT_NE(world.error().what.find("a script in which less moves"), std::string::npos) << world.error().what;
}

TEST(Laparoscope, TissueThatWasCutOutIsGoneFromThePictureAndTheRestStays) {
  const auto world = patient().world(
      {fault(FaultKind::resected, 20, {{"width_mm", 30}, {"depth_mm", 15}, {"aside_mm", 30}, {"over_s", 0}})});
  ASSERT_TRUE(world) << world.error().what;
  const auto scope = Laparoscope::create({.lens = laparoscope_lens(768, 576), .noise = 0});
  ASSERT_TRUE(scope);
  (*scope)->set_cavity({.organ = patient().liver, .wall_centre_mm = patient().truth.liver_centre_mm});
  const double t = world->ends_s() - 3;
  ASSERT_GT(t, 20);
  const auto pose = world->tracker_from_camera(t).inverse() * world->tracker_from_patient(t);
  const auto whole = (*scope)->look_into_cavity(pose, 1);
  (*scope)->change_organ(world->organ(t));
  const auto cut = (*scope)->look_into_cavity(pose, 1);
  std::size_t changed = 0, lit = 0;
  for (std::size_t i = 0; i < whole.size(); i += 3) {
    lit += whole[i] > 20 ? 1U : 0U;
    changed += std::abs(static_cast<int>(whole[i]) - static_cast<int>(cut[i])) > 4 ? 1U : 0U;
  }
  EXPECT_GT(changed, lit / 50);
  EXPECT_LT(changed, lit / 3);
  (*scope)->change_organ({});
  EXPECT_EQ((*scope)->look_into_cavity(pose, 1), whole);
}

}  // namespace
}  // namespace birdseye::hw_sim
