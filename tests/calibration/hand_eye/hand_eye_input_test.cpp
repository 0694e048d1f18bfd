// Stations that do not determine hand-eye, and input that cannot be used: each is named.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/hand_eye_bench.hpp"

namespace birdseye::calibration {
namespace {

using ::testing::Contains;
using testing::HandEyeBench;
using testing::HandEyeScene;
using ::testing::HasSubstr;

const HandEyeScene kGood{.stations = 14, .corner_px = 0.2, .position_mm = 0.3, .angle_deg = 0.1};

/// The verdict, which must be a fail that gives this reason and this advice.
void expect_fail(const HandEyeInput& input, const std::string& reason, const std::string& advice) {
  const auto result = calibrate_hand_eye(input);
  ASSERT_TRUE(result) << result.error().what;
  const Verdict verdict = judge(*result);
  EXPECT_EQ(verdict.grade, Grade::fail);
  EXPECT_THAT(verdict.reasons, Contains(HasSubstr(reason)));
  EXPECT_THAT(verdict.next_steps, Contains(HasSubstr(advice)));
}

TEST(HandEyeInput, GoodStationsPass) {
  const auto result = calibrate_hand_eye(HandEyeBench(kGood).input);
  ASSERT_TRUE(result);
  EXPECT_EQ(judge(*result).grade, Grade::pass) << ::testing::PrintToString(judge(*result).reasons);
}

TEST(HandEyeInput, TooFewStations) {
  HandEyeBench bench(kGood);
  bench.input.stations.resize(2);
  expect_fail(bench.input, "2 stations with board and pose, of at least 3", "take more stations");
  bench.input.stations.resize(1);
  expect_fail(bench.input, "1 station with", "take more stations");
  bench.input.stations.clear();
  EXPECT_EQ(calibrate_hand_eye(bench.input).error().code, Errc::bad_value);
  HandEyeBench four(kGood);
  four.input.stations.resize(4);
  expect_fail(four.input, "4 stations used; at least 5 are needed (10 for a pass)", "take 6 more");
  HandEyeBench nine(kGood);
  nine.input.stations.resize(9);
  const auto fewer = calibrate_hand_eye(nine.input);
  ASSERT_TRUE(fewer);
  EXPECT_THAT(judge(*fewer).reasons, Contains(HasSubstr("stations used; 10 are needed for a pass")));
}

TEST(HandEyeInput, TurnsAboutOneAxisAreNamedWithTheAxis) {
  HandEyeScene scene = kGood;
  scene.one_axis = true;
  scene.position_mm = 1.8;
  scene.angle_deg = 0.5;
  const HandEyeBench bench(scene);
  const auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result);
  EXPECT_FALSE(result->solved);
  // The line of sight, as the sensor sees it.
  const Eigen::Vector3d axis = bench.camera_from_sensor.rotation().transpose().col(2);
  EXPECT_GT(std::abs(axis.dot(result->observability.axes_in_sensor.col(0))), 0.99);
  expect_fail(bench.input, "about one axis", "tilt the scope across that axis by 30 degrees");
  expect_fail(bench.input, "near the camera's line of sight: the translation along it is open", "tilt");
}

TEST(HandEyeInput, NoTurnsAndNarrowTurns) {
  HandEyeScene scene = kGood;
  scene.tilt_rad = scene.roll_rad = 0.02;
  expect_fail(HandEyeBench(scene).input, "hardly turned", "30 degrees or more, about different axes");
  scene.tilt_rad = 0.11;
  scene.roll_rad = 1;
  const auto narrow = calibrate_hand_eye(HandEyeBench(scene).input);
  ASSERT_TRUE(narrow && narrow->solved);
  EXPECT_THAT(judge(*narrow).reasons, Contains(HasSubstr("nearly all turns are about one axis")));
}

TEST(HandEyeInput, TheSamePoseTwice) {
  HandEyeBench bench(kGood);
  bench.input.stations.push_back(bench.input.stations[3]);
  bench.input.stations.back().name = "again";
  const auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result && result->solved);
  EXPECT_THAT(judge(*result).reasons, Contains(HasSubstr("the same pose as")));
  // Only the tracker stood still: which of the pictures its pose belongs to, nobody knows.
  HandEyeBench stuck(kGood);
  stuck.input.stations[6].tracker_from_sensor = stuck.input.stations[5].tracker_from_sensor;
  const auto without = calibrate_hand_eye(stuck.input);
  ASSERT_TRUE(without && without->solved);
  EXPECT_FALSE(without->stations[5].used);
  EXPECT_FALSE(without->stations[6].used);
  EXPECT_THAT(without->stations[6].why_not, HasSubstr("that of station 5 to the last digit, though the board moved"));
  for (HandEyeStation& s : stuck.input.stations) s = stuck.input.stations[0];
  expect_fail(stuck.input, "the same pose as", "take more stations");
}

TEST(HandEyeInput, PosesAndPicturesThatDoNotPair) {
  HandEyeBench bench(kGood);
  auto& stations = bench.input.stations;
  const auto first = stations.front().tracker_from_sensor;
  for (std::size_t i = 0; i + 1 < stations.size(); ++i)
    stations[i].tracker_from_sensor = stations[i + 1].tracker_from_sensor;
  stations.back().tracker_from_sensor = first;
  expect_fail(bench.input, "do not belong together", "the pictures fit the poses that come 1 earlier");
  HandEyeBench random(kGood);
  for (HandEyeStation& s : random.input.stations)
    s.tracker_from_sensor = {rotation_exp(random.normal3()), Eigen::Vector3d(100 * random.normal3())};
  expect_fail(random.input, "do not belong together", "the pose of its own moment");
}

TEST(HandEyeInput, InvertedPoses) {
  HandEyeBench bench(kGood);
  for (HandEyeStation& s : bench.input.stations) {
    const auto inverse = s.tracker_from_sensor.inverse();
    s.tracker_from_sensor = {inverse.rotation(), inverse.translation()};
  }
  expect_fail(bench.input, "seem to be inverted", "say so: --poses-are sensor_from_tracker");
  // Right files, of which it was said all the same.
  bench.input.sensor_inverted = true;
  expect_fail(bench.input, "seem to be inverted", "leave --poses-are out");
  HandEyeScene scene = kGood;
  scene.poses_only = true;
  HandEyeBench eye(scene);
  for (HandEyeStation& s : eye.input.stations) {
    const auto inverse = s.camera_from_marker->inverse();
    s.camera_from_marker = Transform<Camera, Marker>(inverse.rotation(), inverse.translation());
  }
  expect_fail(eye.input, "seem to be inverted", "say --eye-poses-are camera_from_marker");
  eye.input.eye_inverted = true;
  expect_fail(eye.input, "seem to be inverted", "leave --eye-poses-are out; of the tracker's, say --poses-are");
}

TEST(HandEyeInput, PosesOfALeftHandedFrame) {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1, -1, 1).asDiagonal();
  for (const bool poses_only : {false, true}) {
    HandEyeScene scene = kGood;
    scene.poses_only = poses_only;
    HandEyeBench bench(scene);
    for (HandEyeStation& s : bench.input.stations) {
      s.tracker_from_sensor = {mirror * s.tracker_from_sensor.rotation() * mirror,
                               Eigen::Vector3d(mirror * s.tracker_from_sensor.translation())};
    }
    expect_fail(bench.input, "seem to be mirrored", "write a right-handed frame");
  }
}

TEST(HandEyeInput, PositionsWithAnotherSignThanTheirRotations) {
  const auto turned = [](const Eigen::Vector3d& signs) {
    HandEyeBench bench(kGood);
    for (HandEyeStation& s : bench.input.stations) {
      s.tracker_from_sensor = {s.tracker_from_sensor.rotation(),
                               Eigen::Vector3d(signs.cwiseProduct(s.tracker_from_sensor.translation()))};
    }
    return bench.input;
  };
  expect_fail(turned({1, 1, -1}), "wrong sign of z:", "turn positions and rotations alike");
  expect_fail(turned({-1, -1, 1}), "wrong sign of x, y:", "turn positions and rotations alike");
}

TEST(HandEyeInput, PositionsWhoseAxesAreExchanged) {
  const auto read_as = [](const Eigen::Vector3i& axes, const Eigen::Vector3d& signs) {
    HandEyeBench bench(kGood);
    for (HandEyeStation& s : bench.input.stations) {
      const Eigen::Vector3d t = s.tracker_from_sensor.translation();
      s.tracker_from_sensor = {
          s.tracker_from_sensor.rotation(),
          Eigen::Vector3d(signs.cwiseProduct(Eigen::Vector3d(t[axes[0]], t[axes[1]], t[axes[2]])))};
    }
    return bench.input;
  };
  expect_fail(read_as({0, 2, 1}, {1, 1, 1}), "where x, y, z are read from x, z, y", "as they stand");
  expect_fail(read_as({2, 0, 1}, {1, 1, 1}), "where x, y, z are read from y, z, x", "as they stand");
  expect_fail(read_as({0, 2, 1}, {1, 1, -1}), "where x, y, z are read from x, -z, y", "turn positions and rotations");
}

/// As it comes where the four numbers of a quaternion with w first are read with w last.
template <typename Pose>
Pose read_w_last(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  return {Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()), pose.translation()};
}

/// And the other way round.
template <typename Pose>
Pose read_w_first(const Pose& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  return {Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), pose.translation()};
}

template <typename Pose>
Pose round(const Pose& pose) {
  const auto back = pose.inverse();
  return {back.rotation(), back.translation()};
}

TEST(HandEyeInput, QuaternionsOfTheTrackerWithWElsewhere) {
  for (const bool poses_only : {false, true}) {
    HandEyeScene scene = kGood;
    scene.poses_only = poses_only;
    const auto disordered = [&scene](const auto& change) {
      HandEyeBench bench(scene);
      for (HandEyeStation& s : bench.input.stations) s.tracker_from_sensor = change(s.tracker_from_sensor);
      return bench.input;
    };
    const std::string first = "the quaternions of the tracker's poses seem to have w first";
    const std::string last = "the quaternions of the tracker's poses seem to have w last";
    expect_fail(disordered([](const auto& pose) { return read_w_last(pose); }), first, "t,x,y,z,qw,qx,qy,qz");
    expect_fail(disordered([](const auto& pose) { return read_w_first(pose); }), last, "t,x,y,z,qx,qy,qz,qw");
    // Of a file of sensor_from_tracker, which was said.
    expect_fail(disordered([](const auto& pose) { return round(read_w_last(round(pose))); }), first, "qw,qx,qy,qz");
  }
}

TEST(HandEyeInput, QuaternionsOfTheCameraOrOfBothWithWElsewhere) {
  HandEyeScene scene = kGood;
  scene.poses_only = true;
  HandEyeBench eye(scene), both(scene);
  for (HandEyeStation& s : eye.input.stations) s.camera_from_marker = round(read_w_last(round(*s.camera_from_marker)));
  expect_fail(eye.input, "the quaternions of the camera's poses seem to have w first", "qw,qx,qy,qz");
  for (HandEyeStation& s : both.input.stations) {
    s.camera_from_marker = round(read_w_last(round(*s.camera_from_marker)));
    s.tracker_from_sensor = read_w_last(s.tracker_from_sensor);
  }
  expect_fail(both.input, "the quaternions of both files of poses seem to have w first", "qw,qx,qy,qz");
}

TEST(HandEyeInput, ABoardOfAnotherSize) {
  const auto scaled = [](double by) {
    HandEyeBench bench(kGood);
    for (HandEyeStation& s : bench.input.stations) {
      for (Eigen::Vector3d& p : s.view.points_in_marker_mm) p *= by;
    }
    return bench.input;
  };
  expect_fail(scaled(1000), "1000 times smaller than stated: poses in metres", "units");
  expect_fail(scaled(0.001), "1000 times larger than stated", "units");
  expect_fail(scaled(25.4), "inches", "units");
  expect_fail(scaled(1 / 1.1), "mm, not 5.45", "measure the board's squares");
  const auto result = calibrate_hand_eye(scaled(1 / 1.1));
  ASSERT_TRUE(result);
  EXPECT_NEAR(result->observability.board_scale, 1.1, 0.02);
}

TEST(HandEyeInput, TwoFilesOfPosesInDifferentUnits) {
  const auto scaled = [](double eye_by) {
    HandEyeScene scene = kGood;
    scene.poses_only = true;
    HandEyeBench bench(scene);
    for (HandEyeStation& s : bench.input.stations) {
      const auto& pose = *s.camera_from_marker;
      s.camera_from_marker = {pose.rotation(), Eigen::Vector3d(eye_by * pose.translation())};
    }
    return bench.input;
  };
  expect_fail(scaled(1e-3), "the camera's poses seem 1000 times too small", "both files");
  expect_fail(scaled(1e-3), "--eye-unit m", "both files");
  expect_fail(scaled(1 / 25.4), "in inches, taken for mm? Give --eye-unit in", "both files");
  expect_fail(scaled(1e3), "the tracker's poses seem 1000 times too small", "both files");
  expect_fail(scaled(10), "in cm, where the camera's are in mm? Give --unit cm --eye-unit mm", "both files");
}

TEST(HandEyeInput, NumbersThatAreNone) {
  HandEyeBench bench(kGood);
  auto& stations = bench.input.stations;
  stations[1].tracker_from_sensor = {Eigen::Matrix3d(Eigen::Matrix3d::Identity()), Eigen::Vector3d(0, NAN, 0)};
  stations[2].tracker_from_sensor = {Eigen::Matrix3d(Eigen::Matrix3d::Zero()), Eigen::Vector3d::Zero()};
  stations[3].view.points_px[7].x() = std::numeric_limits<double>::infinity();
  stations[4].view = {};
  stations[5].view.points_px.resize(4);
  stations[5].view.points_in_marker_mm.resize(4);
  stations[6].view.points_px.resize(11);  // the first row
  stations[6].view.points_in_marker_mm.resize(11);
  const auto result = calibrate_hand_eye(bench.input);
  ASSERT_TRUE(result && result->solved);
  EXPECT_THAT(result->stations[1].why_not, HasSubstr("rejected: its pose"));
  EXPECT_THAT(result->stations[2].why_not, HasSubstr("no rotation"));
  EXPECT_THAT(result->stations[3].why_not, HasSubstr("corner is not a finite number"));
  EXPECT_THAT(result->stations[4].why_not, HasSubstr("the board is not seen"));
  EXPECT_THAT(result->stations[5].why_not, HasSubstr("4 corners are seen"));
  EXPECT_THAT(result->stations[6].why_not, HasSubstr("on one line"));
  EXPECT_THAT(judge(*result).reasons, Contains(HasSubstr("6 of 14 stations cannot be used")));
  for (HandEyeStation& s : stations) s.tracker_from_sensor = stations[1].tracker_from_sensor;
  expect_fail(bench.input, "cannot be used", "take more stations");
}

TEST(HandEyeInput, WhatCannotBeUsedIsAnError) {
  const HandEyeBench bench(kGood);
  const auto refused = [](HandEyeInput input, const char* words) {
    const auto result = calibrate_hand_eye(input);
    ASSERT_FALSE(result) << words;
    EXPECT_THAT(result.error().what, HasSubstr(words));
  };
  HandEyeInput input = bench.input;
  input.camera.reset();
  refused(input, "corners without a camera");
  input = bench.input;
  input.camera->fx_px = -1;
  refused(input, "focal lengths");
  input = bench.input;
  input.stations[2].tracker_from_body = Transform<Tracker, TrackedBody>();
  refused(input, "of station 0 the board is tracked");
  input = bench.input;
  input.stations[2].camera_from_marker = Transform<Camera, Marker>();
  refused(input, "one holds corners, the other a camera's pose");
  input = bench.input;
  input.stations[1].view.points_px.pop_back();
  refused(input, "87 corners seen, 88 on the board");
  input = bench.input;
  input.stations[1].right_view = input.stations[1].view;
  refused(input, "no second lens");
}

/// From station `from` on the sensor sits elsewhere on the scope, or the board elsewhere.
void slide(HandEyeInput& input, std::size_t from, const Eigen::Vector3d& sensor_mm, const Eigen::Vector3d& board_mm) {
  for (std::size_t i = from; i < input.stations.size(); ++i) {
    const auto& was = input.stations[i].tracker_from_sensor;
    input.stations[i].tracker_from_sensor = {
        was.rotation(), Eigen::Vector3d(was.translation() + was.rotation() * sensor_mm + board_mm)};
  }
}

TEST(HandEyeInput, ASensorThatSlidOrABoardThatMovedHalfWay) {
  const HandEyeScene scene{.stations = 20, .corner_px = 0.15, .position_mm = 0.5, .angle_deg = 0.1};
  HandEyeBench slid(scene);
  slide(slid.input, 10, {3, 0, 0}, {0, 0, 0});
  expect_fail(slid.input, "slid on the scope, or the board moved, between station 9 and station 10",
              "fix the sensor to the scope");
  HandEyeBench moved(scene);
  slide(moved.input, 10, {0, 0, 0}, {0, 3, 0});
  expect_fail(moved.input, "slid on the scope, or the board moved, between station ", "the board to its place");
}

TEST(HandEyeInput, ASlideIsGradedByWhatItIsAtLeast) {
  auto result = calibrate_hand_eye(HandEyeBench(kGood).input);
  ASSERT_TRUE(result && result->solved);
  result->step = HandEyeStep{"a", "b", 6, 2.9, 0, 0, 9, 6};
  EXPECT_THAT(judge(*result).reasons, ::testing::Not(Contains(HasSubstr("slid on the scope"))));
  result->step->shift_sigma_mm = 2.2;
  EXPECT_EQ(judge(*result).grade, Grade::marginal);
  EXPECT_THAT(judge(*result).reasons, Contains(HasSubstr("6.0 mm at the board (at least 1.6)")));
  result->step->shift_sigma_mm = 1;
  EXPECT_EQ(judge(*result).grade, Grade::fail);
}

/// Of stations that tell one direction badly a slide is not told larger than it is.
TEST(HandEyeInput, ASlightSlideIsNoFail) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    HandEyeBench bench({.stations = 12, .position_mm = 0.05, .angle_deg = 0.02, .poses_only = true, .seed = seed});
    slide(bench.input, 8, {0.3, 0, 0}, {0, 0, 0});
    const auto result = calibrate_hand_eye(bench.input);
    ASSERT_TRUE(result && result->solved) << seed;
    const double least_mm = result->step ? result->step->least_shift_mm() : 0;
    EXPECT_LT(least_mm, 0.6) << seed;
  }
}

/// Sound calibrations, of which chance is to be taken for a slide in one of a thousand.
TEST(HandEyeInput, ChanceIsNoSlide) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    const auto result = calibrate_hand_eye(HandEyeBench({.stations = seed % 2 == 0 ? 12 : 20,
                                                         .position_mm = 0.8,
                                                         .angle_deg = 0.2,
                                                         .poses_only = true,
                                                         .seed = seed})
                                               .input);
    ASSERT_TRUE(result && result->solved) << seed;
    EXPECT_FALSE(result->step) << seed << ": " << result->step->sigmas << " sigmas";
  }
}

}  // namespace
}  // namespace birdseye::calibration
