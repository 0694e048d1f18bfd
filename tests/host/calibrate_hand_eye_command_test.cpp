// `calibrate hand-eye`, from the outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/drawn_scope.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::BoardPainter;
using testing::DrawnScope;
using testing::expect_refused;
using ::testing::HasSubstr;
using testing::run;
using testing::Scratch;
using testing::small_lens;

nlohmann::json read(const std::filesystem::path& path) {
  return nlohmann::json::parse(std::ifstream(path));
}

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
struct RightCamera;
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
    scope.write_lens("left.yml", small_lens());
    scope.write_lens("right.yml", small_lens(1.02));
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
  const auto json = read(drawn.scratch / "x.json");
  expect_near(json["camera_from_sensor"], kCameraFromSensor, 0.5, 0.1);
  expect_near(json["right"]["camera_from_sensor"], kRightFromLeft * kCameraFromSensor, 0.5, 0.1);
  EXPECT_NEAR(json["right"]["baseline_mm"].get<double>(), kRightFromLeft.translation().norm(), 1e-9);
  EXPECT_EQ(json["stations_used"], DrawnStereo::kStations);
  EXPECT_EQ(json["right"]["views_used"], DrawnStereo::kStations - 1);
  EXPECT_THAT(json["notes"].dump(), HasSubstr("view_05.png (right): "));
  EXPECT_LT(json["rms_px"].get<double>(), 0.3);
  EXPECT_THAT(testing::contents_of(drawn.scratch / "x.html"), HasSubstr("A stereo scope: 11 of the stations"));
}

TEST(CalibrateHandEyeCommand, BothLensesMayComeFromThePicturesThemselves) {
  const DrawnStereo drawn;
  const auto done = run("birdseye", drawn.pictures + drawn.results);
  ASSERT_EQ(done.code, 0) << done.output;
  const auto json = read(drawn.scratch / "x.json");
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
  const auto json = nlohmann::json::parse(std::ifstream(scratch / "x.json"));
  EXPECT_NEAR(json["clock_offset_ms"].get<double>(), -15, 3);
  EXPECT_EQ(json["camera_from_sensor"].size(), 4U);
  EXPECT_GT(std::filesystem::file_size(scratch / "x.html"), 10'000U);
  EXPECT_TRUE(std::filesystem::exists(scratch / "x.txt"));
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
  EXPECT_THAT(neither.output, HasSubstr("give one of --images (with --board), --eye-poses and --live"));
  const auto no_board = run("birdseye", "calibrate hand-eye --poses . --images .");
  EXPECT_EQ(no_board.code, 2);
  EXPECT_THAT(no_board.output, HasSubstr("--board is missing"));
}

}  // namespace
}  // namespace birdseye
