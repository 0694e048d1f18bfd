// `calibrate hand-eye`, from the outside.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "calibration/geometry/rod.hpp"
#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/drawn_scope.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/hand_eye_stream.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/lens_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye {
namespace {

using testing::BoardPainter;
using testing::DrawnScope;
using testing::expect_refused;
using ::testing::HasSubstr;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_lens;

template <typename To, typename From>
void expect_near(const nlohmann::json& rows, const Transform<To, From>& truth, double mm, double deg) {
  Eigen::Matrix4d matrix;
  for (Eigen::Index r = 0; r < 4; ++r) {
    for (Eigen::Index c = 0; c < 4; ++c)
      matrix(r, c) = rows.at(static_cast<std::size_t>(r)).at(static_cast<std::size_t>(c));
  }
  const auto found = Transform<To, From>::from_matrix(matrix);
  EXPECT_LT((found.inverse().translation() - truth.inverse().translation()).norm(), mm);
  EXPECT_LT(rotation_angle_between(found.rotation(), truth.rotation()) * kDegPerRad, deg);
}

/// Of a stereo scope.
const Transform<Camera, Sensor> kCameraFromSensor(rotation_exp({0.2, -1.5, 0.1}), {6, -14, -300});
const Transform<RightCamera, Camera> kRightFromLeft(rotation_exp({0.01, -0.03, 0.002}), {-4.4, 0.1, 0.05});

/// Twelve stations of it: left/view1.png .., right/view_012.png .., poses/1.txt .. and the lenses.
struct DrawnStereo {
  static constexpr int kStations = 12;
  const Scratch scratch;

  DrawnStereo() {
    DrawnScope scope(scratch.path());
    const auto views = scope.views(kStations);
    const BoardPainter left_lens(small_lens()), right_lens(small_lens(1.02));
    for (int i = 0; i < kStations; ++i) {
      const auto& left = views[static_cast<std::size_t>(i)];
      const auto right = kRightFromLeft * left;
      const double light = i == 4 ? 12 : 200;  // too dark, to the right
      scope.paint("left/view" + std::to_string(i + 1) + ".png", left_lens, left);
      scope.paint("right/view_0" + std::to_string(i + 1) + ".png", right_lens, {right.rotation(), right.translation()},
                  light);
      scope.write_pose("poses/" + std::to_string(i + 1) + ".txt", left, kCameraFromSensor);
    }
    testing::write_lens(scratch / "left.yml", small_lens());
    testing::write_lens(scratch / "right.yml", small_lens(1.02));
    scope.write_matrix("relation.txt", kRightFromLeft);
    scope.write_matrix("exchanged.txt", kRightFromLeft.inverse());
    pictures = "calibrate hand-eye --board " + scope.board() + " --poses " + (scratch / "poses").string() +
               " --images " + (scratch / "left").string() + " --right-images " + (scratch / "right").string();
    results = " --json " + (scratch / "x.json").string() + " --report " + (scratch / "x.html").string();
  }
  [[nodiscard]] std::string lenses(const std::string& relation) const {
    return " --camera " + (scratch / "left.yml").string() + " --right-camera " + (scratch / "right.yml").string() +
           " --right-from-left " + (scratch / relation).string();
  }
  std::string pictures, results;
};

TEST(CalibrateHandEyeCommand, ASecondCameraIsUsedWithItsLens) {
  const DrawnStereo drawn;
  const auto done = run("birdseye", drawn.pictures + drawn.lenses("relation.txt") + drawn.results);
  ASSERT_EQ(done.code, 0) << done.output;
  const auto json = read_json(drawn.scratch / "x.json");
  expect_near(json["camera_from_sensor"], kCameraFromSensor, 0.5, 0.1);
  expect_near(json["right"]["camera_from_sensor"], kRightFromLeft * kCameraFromSensor, 0.5, 0.1);
  EXPECT_NEAR(json["right"]["baseline_mm"].get<double>(), kRightFromLeft.translation().norm(), 1e-9);
  EXPECT_EQ(json["stations_used"], DrawnStereo::kStations);
  EXPECT_EQ(json["right"]["views_used"], DrawnStereo::kStations - 1);
  EXPECT_THAT(json["notes"].dump(), HasSubstr("view_05.png (right): "));
  EXPECT_LT(json["rms_px"].get<double>(), 0.3);
  const std::string page = testing::contents_of(drawn.scratch / "x.html");
  EXPECT_THAT(page, HasSubstr("A stereo scope: 11 of the stations"));
  EXPECT_THAT(page, HasSubstr("<image href='data:image/png;base64,")) << "the worst station's picture";
  EXPECT_THAT(page, HasSubstr("places of the camera, from above"));
  EXPECT_THAT(page, HasSubstr("before: "));
  EXPECT_THAT(page, HasSubstr("after refining"));
}

TEST(CalibrateHandEyeCommand, BothLensesMayComeFromThePicturesThemselves) {
  const DrawnStereo drawn;
  const auto done = run("birdseye", drawn.pictures + drawn.results);
  ASSERT_EQ(done.code, 0) << done.output;
  const auto json = read_json(drawn.scratch / "x.json");
  expect_near(json["camera_from_sensor"], kCameraFromSensor, 2, 0.4);
  EXPECT_NEAR(json["right"]["baseline_mm"].get<double>(), kRightFromLeft.translation().norm(), 0.2);
}

TEST(CalibrateHandEyeCommand, WhatDoesNotMakeAPairIsRefused) {
  const DrawnStereo drawn;
  expect_refused("birdseye", drawn.pictures + drawn.lenses("exchanged.txt"), {"exchanged.txt", "exchanged", "px"});
  std::filesystem::rename(drawn.scratch / "right/view_03.png", drawn.scratch / "right/view_30.png");
  expect_refused("birdseye", drawn.pictures + drawn.lenses("relation.txt"),
                 {"view3.png (left)", "view_30.png (right)"});
  const std::string start = "calibrate hand-eye --board chessboard:10x7:6mm --poses . ";
  expect_refused("birdseye", start + "--images . --right-images . --camera x.yml",
                 {"--right-from-left", "none of them"});
  expect_refused("birdseye", start + "--images . --right-images . --right-camera x.yml",
                 {"--right-camera and --right-from-left together"});
  expect_refused("birdseye", start + "--images . --right-camera x.yml --right-from-left y.txt",
                 {"--right-images is missing"});
  expect_refused("birdseye", start + "--live --right-images .", {"--right-images goes with --images"});
}

/// A 30 degree scope: its rod runs along the sensor's z, 12 mm beside it, and the camera sits 300 mm down.
RodScope oblique_scope() {
  RodScope scope;
  scope.axis_in_sensor = Eigen::Vector3d(0.02, -0.01, 1).normalized();
  scope.axis_point_in_sensor_mm = {12, -3, 0};
  const Eigen::Matrix3d onto =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(0, 0, 1), scope.axis_in_sensor).toRotationMatrix();
  const Transform<Sensor, Camera> pose(Eigen::Matrix3d(onto * rotation_exp({30 * kRadPerDeg, 0, 0})),
                                       Eigen::Vector3d(scope.axis_point_in_sensor_mm + 300 * scope.axis_in_sensor));
  scope.camera_from_sensor_at_zero = pose.inverse();
  return scope;
}

/// Stations of it at two angles of the rod, the first ones at 20 degrees: images/view1.png .., poses/1.txt .., the
/// lens.
struct DrawnRod {
  static constexpr int kFirst = 11, kSecond = 10;
  const Scratch scratch;
  const RodScope truth = oblique_scope();
  std::string command;

  DrawnRod() {
    DrawnScope scope(scratch.path());
    const auto views = scope.views(kFirst + kSecond);
    const BoardPainter lens(small_lens());
    for (std::size_t i = 0; i < views.size(); ++i) {
      const std::string number = std::to_string(i + 1);
      scope.paint("images/view" + number + ".png", lens, views[i]);
      scope.write_pose("poses/" + number + ".txt", views[i],
                       truth.camera_from_sensor((i < kFirst ? 20 : 110) * kRadPerDeg));
    }
    testing::write_lens(scratch / "lens.yml", small_lens());
    command = "calibrate hand-eye --board " + scope.board() + " --poses " + (scratch / "poses").string() +
              " --images " + (scratch / "images").string() + " --camera " + (scratch / "lens.yml").string() +
              " --json " + (scratch / "x.json").string();
  }
  /// The option, with a file that states these angles, and last a line as given.
  [[nodiscard]] std::string angles(double first_deg, double second_deg, const std::string& line = {}) const {
    std::string text = "name,angle_deg\n";
    for (int i = 0; i < kFirst + kSecond; ++i)
      text += "view" + std::to_string(i + 1) + (i % 2 == 0 ? ".png" : "") + ", " +
              std::to_string(i < kFirst ? first_deg : second_deg) + "\n";
    return " --rod-angles " + scratch.file("angles.csv", text + line);
  }
};

TEST(CalibrateHandEyeCommand, ARodTurnedByKnownAnglesGivesItsAxis) {
  const DrawnRod drawn;
  calibration::CalibrationRecord before = testing::example_record(640, 400, {}, {});
  before.lens->camera = small_lens();
  before.hand_eye.reset();
  const std::string record = drawn.scratch.file("record.json", testing::signed_record_text(before));
  const auto done = run("birdseye", drawn.command + drawn.angles(20, 110) + " --record " + record + " --report " +
                                        (drawn.scratch / "x.html").string());
  ASSERT_EQ(done.code, 0) << done.output;
  const auto json = read_json(drawn.scratch / "x.json");
  EXPECT_EQ(json["rod"]["reference_angle_deg"], 20);
  EXPECT_EQ(json["rod"]["picture_turn"], 1);
  EXPECT_EQ(json["rod"]["angles"].size(), 2U);
  EXPECT_EQ(json["stations"].size(), static_cast<std::size_t>(DrawnRod::kFirst));
  expect_near(json["camera_from_sensor"], drawn.truth.camera_from_sensor(20 * kRadPerDeg), 0.5, 0.1);
  EXPECT_THAT(testing::contents_of(drawn.scratch / "x.html"), HasSubstr("The rod"));
  // Whoever reads the record knows where the camera is at angles that were not calibrated.
  const auto after = calibration::parse_record(testing::contents_of(record));
  ASSERT_TRUE(after && after->hand_eye && after->hand_eye->rod);
  const calibration::RodEntry& rod = *after->hand_eye->rod;
  const RodScope scope{after->hand_eye->camera_from_sensor, rod.axis_in_sensor, rod.axis_point_in_sensor_mm,
                       rod.picture_turn};
  for (const double deg : {20.0, 65.0, 110.0, 150.0}) {
    const auto found = scope.camera_from_sensor((deg - rod.reference_angle_deg) * kRadPerDeg);
    const auto truth = drawn.truth.camera_from_sensor(deg * kRadPerDeg);
    EXPECT_LT((found.inverse().translation() - truth.inverse().translation()).norm(), 1) << deg;
    EXPECT_LT(rotation_angle_between(found.rotation(), truth.rotation()) * kDegPerRad, 0.2) << deg;
  }
}

TEST(CalibrateHandEyeCommand, AnglesOfTheRodThatAreWrongDoNotPass) {
  const DrawnRod drawn;
  const auto wrong = run("birdseye", drawn.command + drawn.angles(20, 80));
  EXPECT_EQ(wrong.code, 3) << wrong.output;
  EXPECT_THAT(wrong.output, HasSubstr("turned wrongly by"));
  const auto one = run("birdseye", drawn.command + drawn.angles(20, 25));
  EXPECT_EQ(one.code, 3) << one.output;
  EXPECT_THAT(one.output, HasSubstr("at least 20 degrees apart"));
  expect_refused("birdseye", drawn.command + drawn.angles(20, 110, "view99,20\n"), {"view99"});
  expect_refused("birdseye", drawn.command + drawn.angles(20, 110, "view1,20,30\n"), {"view1,20 is none"});
  expect_refused("birdseye", drawn.command + drawn.angles(20, 110, "view1.png,20\n"),
                 {"angles.csv:23", "second angle"});
  expect_refused("birdseye", drawn.command + drawn.angles(20, 110, "view1;20\n"), {"angles.csv:23"});
  expect_refused("birdseye", drawn.command + " --rod-angles " + drawn.scratch.file("few.csv", "view1,20\n"),
                 {"no angle for view2.png"});
}

TEST(CalibrateHandEyeCommand, PairsTwoStreamsOfPoses) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const Scratch scratch;
  const std::string stem = (*data / "handeye_pose_streams/robot_arm_complete_bag_color_and_ir_").string();
  const auto done =
      run("birdseye", "calibrate hand-eye --unit m --poses " + stem + "base_link_sr300_hinge.csv" + " --eye-poses " +
                          stem + "target_ir.csv --out " + (scratch / "x.txt").string() + " --json " +
                          (scratch / "x.json").string() + " --report " + (scratch / "x.html").string());
  ASSERT_EQ(done.code, 0) << done.output;
  const auto json = read_json(scratch / "x.json");
  EXPECT_NEAR(json["clock_offset_ms"].get<double>(), 15, 3);  // as latency: the pictures' times are late
  EXPECT_EQ(json["camera_from_sensor"].size(), 4U);
  EXPECT_GT(std::filesystem::file_size(scratch / "x.html"), 10'000U);
  EXPECT_TRUE(std::filesystem::exists(scratch / "x.txt"));
}

std::string row_of(double time_s, const Eigen::Matrix4d& pose) {
  const Eigen::Quaterniond q(Eigen::Matrix3d(pose.topLeftCorner<3, 3>()));
  return fmt::format("{},{},{},{},{},{},{},{}\n", time_s, pose(0, 3), pose(1, 3), pose(2, 3), q.x(), q.y(), q.z(),
                     q.w());
}

/// Two trackers on one tool; the second one's world begins 1.2 m behind what it tracks.
TEST(CalibrateHandEyeCommand, TwoTrackersAreJudgedWhereTheirPosesAre) {
  const Scratch scratch;
  const testing::HandEyeStream stream({.seconds = 30, .sensor_hz = 30, .camera_hz = 10, .bent_mm = 0});
  std::string hand = "t,x,y,z,qx,qy,qz,qw\n", eye = hand;
  for (const auto& s : stream.sensor) hand += row_of(s.time_s, s.tracker_from_sensor.matrix());
  const Eigen::Vector3d far_mm(300, -200, -1200);
  for (const auto& s : stream.views) {
    Eigen::Matrix4d pose = s.camera_from_marker.inverse().matrix();
    pose.topRightCorner<3, 1>() -= far_mm;
    eye += row_of(s.time_s, pose);
  }
  const std::string command = "calibrate hand-eye --poses " + scratch.file("hand.csv", hand) + " --eye-poses " +
                              scratch.file("eye.csv", eye) + " --json " + (scratch / "x.json").string();
  const auto here = run("birdseye", command + " --out " + (scratch / "x.txt").string());
  EXPECT_EQ(here.code, 0) << here.output;
  EXPECT_THAT(here.output, HasSubstr("in the middle of those poses"));
  EXPECT_TRUE(std::filesystem::exists(scratch / "x.txt"));
  const auto at_poses = read_json(scratch / "x.json");
  run("birdseye", command + " --at 0,0,0");
  const auto at_origin = read_json(scratch / "x.json");
  EXPECT_GT(at_origin["sigma_at_board_mm"].get<double>(), 2 * at_poses["sigma_at_board_mm"].get<double>());
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      EXPECT_NEAR(at_origin["camera_from_sensor"][i][j].get<double>(),
                  at_poses["camera_from_sensor"][i][j].get<double>(), 0.05);
      EXPECT_NEAR(at_origin["tracker_from_pattern"][i][j].get<double>(),
                  at_poses["tracker_from_pattern"][i][j].get<double>(), 0.2);
    }
  }
  expect_refused("birdseye", command + " --at 1,2", {"--at"});
}

TEST(CalibrateHandEyeCommand, CamerasThatLookAwayFromTheBoardAreTold) {
  const Scratch scratch;
  const testing::HandEyeStream stream({.seconds = 30, .sensor_hz = 30, .camera_hz = 10, .bent_mm = 0});
  const std::string head = "t,x,y,z,qx,qy,qz,qw\n";
  std::string hand = head, opengl = head, hand_left = head, eye_left = head;
  const Eigen::Matrix4d turned = Eigen::Vector4d(1, -1, -1, 1).asDiagonal();
  const Eigen::Matrix4d mirror = Eigen::Vector4d(1, 1, -1, 1).asDiagonal();
  for (const auto& s : stream.sensor) {
    hand += row_of(s.time_s, s.tracker_from_sensor.matrix());
    hand_left += row_of(s.time_s, mirror * s.tracker_from_sensor.matrix() * mirror);
  }
  for (const auto& s : stream.views) {
    const Eigen::Matrix4d pose = s.camera_from_marker.inverse().matrix();
    opengl += row_of(s.time_s, pose * turned);
    eye_left += row_of(s.time_s, mirror * pose * mirror);
  }
  hand = " --poses " + scratch.file("hand.csv", hand) + " --eye-poses " + scratch.file("opengl.csv", opengl);
  hand_left = " --poses " + scratch.file("left.csv", hand_left) + " --eye-poses " + scratch.file("eye.csv", eye_left);
  for (const std::string& files : {hand, hand_left}) {
    const auto done = run("birdseye", "calibrate hand-eye --json " + (scratch / "x.json").string() + files);
    EXPECT_NE(read_json(scratch / "x.json")["verdict"], "pass") << done.output;
    EXPECT_THAT(done.output, HasSubstr("OpenGL's axes, or left-handed"));
  }
}

/// Its axes meet at the trocar, 110 mm behind the lens, and the world's origin is farther behind.
TEST(CalibrateHandEyeCommand, AScopeThatTurnsInATrocarDoesNotFail) {
  const Scratch scratch;
  const testing::HandEyeStream stream({.seconds = 30, .sensor_hz = 30, .camera_hz = 10, .bent_mm = 0});
  std::string hand = "t,x,y,z,qx,qy,qz,qw\n", eye = hand;
  const Eigen::Matrix4d turned = Eigen::Vector4d(1, -1, -1, 1).asDiagonal();
  for (const auto& s : stream.sensor) hand += row_of(s.time_s, s.tracker_from_sensor.matrix());
  for (const auto& s : stream.views) {
    Eigen::Matrix4d pose = s.camera_from_marker.inverse().matrix() * turned;
    pose.topRightCorner<3, 1>() += Eigen::Vector3d(0, 0, pose(2, 3) > 0 ? 300 : -300);
    eye += row_of(s.time_s, pose);
  }
  const std::string command = "calibrate hand-eye --poses " + scratch.file("hand.csv", hand) + " --eye-poses " +
                              scratch.file("eye.csv", eye) + " --json " + (scratch / "x.json").string();
  const auto done = run("birdseye", command);
  EXPECT_EQ(done.code, 0) << done.output;
  EXPECT_EQ(read_json(scratch / "x.json")["verdict"], "marginal") << done.output;
  EXPECT_THAT(done.output, HasSubstr("or does the scope turn in a trocar there?"));
  const auto asked = run("birdseye", command + " --at 0,0,0");
  EXPECT_EQ(asked.output.find("trocar"), std::string::npos) << asked.output;
}

/// What OpenCV finds is where the board is in the camera's frame.
TEST(CalibrateHandEyeCommand, BothStreamsInvertedAreNoHandEye) {
  const Scratch scratch;
  const testing::HandEyeStream stream({.seconds = 30, .sensor_hz = 30, .camera_hz = 10, .bent_mm = 0});
  const std::string head = "t,x,y,z,qx,qy,qz,qw\n";
  std::string hand = head, hand_inverted = head, eye = head, eye_inverted = head;
  for (const auto& s : stream.sensor) {
    hand += row_of(s.time_s, s.tracker_from_sensor.matrix());
    hand_inverted += row_of(s.time_s, s.tracker_from_sensor.inverse().matrix());
  }
  for (const auto& s : stream.views) {
    eye += row_of(s.time_s, s.camera_from_marker.inverse().matrix());
    eye_inverted += row_of(s.time_s, s.camera_from_marker.matrix());
  }
  hand = " --poses " + scratch.file("hand.csv", hand);
  hand_inverted = " --poses " + scratch.file("hand_inverted.csv", hand_inverted);
  eye = " --eye-poses " + scratch.file("eye.csv", eye);
  eye_inverted = " --eye-poses " + scratch.file("eye_inverted.csv", eye_inverted);
  const std::string command = "calibrate hand-eye --json " + (scratch / "x.json").string();
  const auto translation = [&] {
    const auto json = read_json(scratch / "x.json");
    Eigen::Vector3d at_mm;
    for (std::size_t i = 0; i < 3; ++i)
      at_mm[static_cast<Eigen::Index>(i)] = json["camera_from_sensor"][i][3].get<double>();
    return at_mm;
  };
  EXPECT_EQ(run("birdseye", command + hand + eye).code, 0);
  const Eigen::Vector3d truth_mm = translation();

  const auto one = run("birdseye", command + hand + eye_inverted);
  EXPECT_EQ(one.code, 3) << one.output;
  EXPECT_THAT(one.output, HasSubstr("--eye-poses-are camera_from_marker"));
  const auto said = run("birdseye", command + hand + eye_inverted + " --eye-poses-are camera_from_marker");
  EXPECT_EQ(said.code, 0) << said.output;
  EXPECT_LT((translation() - truth_mm).norm(), 0.01);

  for (const char* kind : {"hand-eye", "latency"}) {
    expect_refused("birdseye",
                   std::string("calibrate ") + kind + hand + " --eye-poses " + (scratch / "hand.csv").string(),
                   {"hand.csv and ", "the same poses to the last digit"});
  }
  const std::string of_tracker = " --poses-are sensor_from_tracker";
  for (const std::string& both : {hand + eye_inverted + of_tracker, hand_inverted + eye_inverted}) {
    const auto wrong = run("birdseye", command + both);
    EXPECT_EQ(wrong.output.find("verdict: pass"), std::string::npos) << wrong.output;
    EXPECT_THAT(wrong.output, HasSubstr("both streams of poses seem to be inverted"));
  }
  const auto right =
      run("birdseye", command + hand_inverted + eye_inverted + of_tracker + " --eye-poses-are camera_from_marker");
  EXPECT_EQ(right.code, 0) << right.output;
  EXPECT_LT((translation() - truth_mm).norm(), 0.01);
  expect_refused(
      "birdseye",
      "calibrate hand-eye --board chessboard:10x7:6mm --poses . --images . --eye-poses-are camera_from_marker",
      {"--eye-poses-are goes with --eye-poses"});
}

TEST(CalibrateHandEyeCommand, NamesBothCountsWherePicturesAndPosesDoNotPair) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const std::string stem = (*data / "laparoscope_charuco_handeye/calib.").string();
  const auto refused = run(
      "birdseye", "calibrate hand-eye --board charuco:19x26:5mm:4mm:DICT_4X4_250:legacy --images " + stem +
                      "left.images.0.png " + stem + "left.images.1.png --poses '" + stem + "device_tracking.*.txt'");
  EXPECT_EQ(refused.code, 2);
  EXPECT_THAT(refused.output, HasSubstr("2 pictures and 6 poses of the sensor"));
}

TEST(CalibrateHandEyeCommand, RefusesUsageThatMakesNoSense) {
  const auto neither = run("birdseye", "calibrate hand-eye --poses .");
  EXPECT_EQ(neither.code, 2);
  EXPECT_THAT(neither.output, HasSubstr("give one of --images (with --board), --points, --eye-poses and --live"));
  const auto no_board = run("birdseye", "calibrate hand-eye --poses . --images .");
  EXPECT_EQ(no_board.code, 2);
  EXPECT_THAT(no_board.output, HasSubstr("--board is missing"));
  expect_refused(
      "birdseye", "calibrate hand-eye --poses . --eye-poses . --eye-unit metres",
      {"--eye-unit: \"metres\" is no unit that is read of the lengths in --eye-poses", "say mm, cm, m or in"});
  expect_refused("birdseye", "calibrate hand-eye --poses . --images . --board chessboard:9x6:5mm --eye-unit m",
                 {"--eye-unit goes with --eye-poses"});
}

TEST(CalibrateHandEyeCommand, WhatWouldBeOfNoEffectIsRefusedByName) {
  const std::string files = "calibrate hand-eye --board chessboard:10x7:6mm --poses . --images . ";
  for (const char* option : {"--bird", "--server", "--seconds", "--stations", "--most-stations", "--keep"})
    expect_refused("birdseye", files + option + " 20", {std::string(option) + " goes with --live"});
  for (const char* option : {"--board-tool", "--board-body"})
    expect_refused("birdseye", files + option + " a", {"--board-", "goes with --board-poses"});
  expect_refused("birdseye", files + "--eye-tool a", {"--eye-transform goes with --eye-poses"});
  expect_refused("birdseye", files + "--size 640x480", {"--size goes with --points"});
  const std::string live = "calibrate hand-eye --board chessboard:10x7:6mm --live --server 127.0.0.1:1 ";
  for (const char* option : {"--poses .", "--unit m", "--tool Scope", "--poses-are sensor_from_tracker"})
    expect_refused("birdseye", live + option, {"--live takes none: leave it out"});
  expect_refused("birdseye", "calibrate hand-eye --board chessboard:10x7:6mm --recording . --server a",
                 {"--server goes with --live"});
}

TEST(CalibrateHandEyeCommand, StreamsOfOtherTimesAreToldBySpans) {
  const Scratch scratch;
  std::string early, late;
  for (int i = 0; i < 400; ++i) {
    const double angle = 0.4 * std::sin(0.11 * i) + 0.2 * std::sin(0.043 * i);
    const std::string turned = fmt::format("{:.9f},0,0,{:.9f}\n", std::sin(angle / 2), std::cos(angle / 2));
    early += fmt::format("{:.3f},1,2,300,{}", 100 + 0.02 * i, turned);
    late += fmt::format("{:.3f},5,2,100,{}", 500 + 0.02 * i, turned);
  }
  expect_refused(
      "birdseye",
      "calibrate hand-eye --poses " + scratch.file("hand.csv", early) + " --eye-poses " + scratch.file("eye.csv", late),
      {"do not overlap in time", "from 100.000 to 107.980 s", "from 500.000 to 507.980 s"});
}

}  // namespace
}  // namespace birdseye
