// `calibrate camera`, from the outside.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/board_views.hpp"
#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/drawn_scope.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::BoardScene;
using testing::expect_refused;
using testing::hd_lens;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_lens;

/// Views as a folder of points.
std::string write_points(const Scratch& scratch, const std::string& name,
                         const std::vector<calibration::PatternView>& views) {
  fs::create_directories(scratch / name);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto open = [&](const char* what) {
      std::ofstream file(scratch / name / (std::string(what) + "." + std::to_string(v) + ".txt"));
      file.precision(12);
      return file;
    };
    std::ofstream ids = open("ids"), object = open("object_points"), image = open("image_points");
    for (std::size_t i = 0; i < views[v].ids.size(); ++i) {
      ids << views[v].ids[i] << '\n';
      object << views[v].points_in_marker_mm[i].transpose() << '\n';
      image << views[v].points_px[i].transpose() << '\n';
    }
  }
  return (scratch / name).string();
}

TEST(CalibrateCameraCommand, WritesCameraFiguresAndPage) {
  const Scratch scratch;
  auto views = BoardScene().views(hd_lens(), 14, 3);
  views[2].points_px[5] += Eigen::Vector2d(9, 9);
  views[4].points_px[7].x() = NAN;
  const std::string points = write_points(scratch, "points", views);
  const auto done =
      run("birdseye", "calibrate camera --points " + points + " --size 1920x1080 --rod-angle-deg 30 --out " +
                          (scratch / "c.yaml").string() + " --json " + (scratch / "c.json").string() + " --report " +
                          (scratch / "c.html").string());
  ASSERT_EQ(done.code, 0) << done.output;
  const nlohmann::json json = read_json(scratch / "c.json");
  EXPECT_EQ(json["verdict"], "pass") << json["reasons"];
  EXPECT_NE(json["model"], "pinhole");  // one term is true; a second may do as well
  EXPECT_EQ(json["image_width_px"], 1920);
  EXPECT_EQ(json["rod_angle_deg"], 30);
  EXPECT_NEAR(json["camera_matrix"][0][0].get<double>(), hd_lens().fx_px, 3 * json["sigma"]["fx_px"].get<double>());
  EXPECT_NEAR(json["distortion"][0].get<double>(), hd_lens().k1, 3 * json["sigma"]["k1"].get<double>());
  EXPECT_EQ(json["views_used"], 13);
  ASSERT_EQ(json["views_rejected"].size(), 1U);
  EXPECT_EQ(json["views_rejected"][0]["name"], "image_points.4.txt");
  EXPECT_EQ(json["views_rejected"][0]["reason"], "point 7 is not a finite number");
  ASSERT_EQ(json["outliers"].size(), 1U);
  EXPECT_EQ(json["outliers"][0]["name"], "image_points.2.txt");
  EXPECT_EQ(json["models"].size(), 5U);
  EXPECT_GE(json["held_out_px"], json["rms_px"]);
  EXPECT_NE(testing::contents_of(scratch / "c.yaml").find("camera_matrix"), std::string::npos);
  const std::string page = testing::contents_of(scratch / "c.html");
  for (const char* words : {"<svg", "held out, px", "image_points.4.txt", "coverage", "convergence",
                            "What the lens does", "Where the board was looked at from", "The view that fits worst"})
    EXPECT_NE(page.find(words), std::string::npos) << words;
  EXPECT_EQ(page.find("http-equiv"), std::string::npos);
}

TEST(CalibrateCameraCommand, ThePublishedWebcam) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const Scratch scratch;
  const auto done = run("birdseye", "calibrate camera --points " + (*data / "camera_chessboard_webcam").string() +
                                        " --model radial3_tangential2 --plain --json " + (scratch / "c.json").string());
  ASSERT_EQ(done.code, 0) << done.output;
  const nlohmann::json json = read_json(scratch / "c.json");
  EXPECT_LE(json["rms_px"].get<double>(), 1.4114);
  EXPECT_EQ(json["image_height_px"], 480);  // from the pictures beside the points
  EXPECT_NEAR(json["camera_matrix"][1][1].get<double>(), 606.134214, 1e-5);
  EXPECT_NEAR(json["distortion"][4].get<double>(), 0.19656551, 1e-6);
  EXPECT_EQ(json["views_used"], 12);
}

TEST(CalibrateCameraCommand, TwoCameras) {
  const Scratch scratch;
  BoardScene scene;
  const Transform<Camera, Camera> right_from_left(rotation_exp({0.004, -0.03, 0.01}), {-4.4, 0.05, 0.1});
  std::vector<calibration::PatternView> left, right;
  std::mt19937 rng(3);
  for (const auto& pose : scene.poses(12, 5)) {
    left.push_back(scene.view(hd_lens(), pose, rng, ""));
    right.push_back(scene.view(hd_lens(-0.2), right_from_left * pose, rng, ""));
  }
  const std::string common = "calibrate camera --size 1920x1080 --points " + write_points(scratch, "left", left) +
                             " --right-out " + (scratch / "r.yaml").string() + " --right-from-left-out " +
                             (scratch / "rl.txt").string() + " --json " + (scratch / "c.json").string();
  const auto done = run("birdseye", common + " --right-points " + write_points(scratch, "right", right));
  ASSERT_EQ(done.code, 0) << done.output;
  const nlohmann::json json = read_json(scratch / "c.json");
  EXPECT_NEAR(json["stereo"]["baseline_mm"].get<double>(), right_from_left.translation().norm(), 0.1);
  EXPECT_NEAR(json["stereo"]["right_from_left"][0][3].get<double>(), -4.4, 0.1);
  EXPECT_LT(json["stereo"]["epipolar_rms_px"].get<double>(), 0.4);
  EXPECT_EQ(json["right"]["model"], "radial1");
  EXPECT_TRUE(fs::exists(scratch / "r.yaml") && fs::exists(scratch / "rl.txt"));
  right.pop_back();
  expect_refused("birdseye", common + " --right-points " + write_points(scratch, "fewer", right),
                 {"image_points.11.txt (left)", "pair by name"});
}

TEST(CalibrateCameraCommand, LeftAndRightPicturesPairByName) {
  const Scratch scratch;
  testing::DrawnScope scope(scratch.path());
  const Transform<Camera, Camera> right_from_left(rotation_exp({0.004, -0.03, 0.01}), {-4.4, 0.05, 0.1});
  const auto boards = scope.views(11);
  const testing::BoardPainter lens(small_lens());
  for (std::size_t i = 0; i < boards.size(); ++i) {
    // One too dark on either side: what is left is as many, and not the same moments.
    scope.paint("l/cam0_" + std::to_string(i + 1) + ".png", lens, boards[i], i == 2 ? 12 : 200);
    scope.paint(std::string(i < 9 ? "r/cam1_00" : "r/cam1_0") + std::to_string(i + 1) + ".png", lens,
                right_from_left * boards[i], i == 6 ? 12 : 200);
  }
  const std::string command = "calibrate camera --board " + scope.board() + " --images " + (scratch / "l").string() +
                              " --right-images " + (scratch / "r").string() + " --json " +
                              (scratch / "c.json").string();
  const auto done = run("birdseye", command);
  ASSERT_EQ(done.code, 0) << done.output;
  const nlohmann::json json = read_json(scratch / "c.json");
  EXPECT_EQ(json["stereo"]["pairs_used"], 9);
  EXPECT_NEAR(json["stereo"]["baseline_mm"].get<double>(), right_from_left.translation().norm(), 0.15);
  ASSERT_EQ(json["views_rejected"].size(), 1U);
  EXPECT_EQ(json["views_rejected"][0]["name"], "cam0_3.png");
  ASSERT_EQ(json["right"]["views_rejected"].size(), 1U);
  EXPECT_EQ(json["right"]["views_rejected"][0]["name"], "cam1_007.png");

  fs::rename(scratch / "r/cam1_004.png", scratch / "r/cam1_012.png");
  expect_refused("birdseye", command, {"cam0_4.png (left)", "cam1_012.png (right)"});
}

TEST(CalibrateCameraCommand, WhatIsReadableAndNotWorthALensFails) {
  const Scratch scratch;
  const auto views = BoardScene().views(hd_lens(), 2, 3);
  const auto done =
      run("birdseye", "calibrate camera --size 1920x1080 --points " + write_points(scratch, "p", views) + " --out " +
                          (scratch / "c.yaml").string() + " --json " + (scratch / "c.json").string());
  EXPECT_EQ(done.code, 3) << done.output;
  const nlohmann::json json = read_json(scratch / "c.json");
  EXPECT_EQ(json["verdict"], "fail");
  EXPECT_NE(json["reasons"][0].get<std::string>().find("2 usable views"), std::string::npos);
  EXPECT_FALSE(json["next_steps"].empty());
  EXPECT_FALSE(fs::exists(scratch / "c.yaml"));
}

TEST(CalibrateCameraCommand, WhatCannotBeReadIsRefusedInOneLine) {
  const Scratch scratch;
  const fs::path out = scratch / "c.yaml";
  const std::string end = " --out " + out.string();
  const std::string points = write_points(scratch, "p", BoardScene().views(hd_lens(), 5, 3));
  expect_refused("birdseye", "calibrate camera" + end, {"--images", "--points"}, out);
  expect_refused("birdseye", "calibrate camera --points /nowhere" + end, {"/nowhere"}, out);
  expect_refused("birdseye", "calibrate camera --points " + points + end, {"--size"}, out);
  expect_refused("birdseye", "calibrate camera --size 1920 --points " + points + end, {"--size 1920"}, out);
  expect_refused("birdseye", "calibrate camera --size 1920x1080 --model fisheye --points " + points + end,
                 {"--model fisheye", "radial1"}, out);
  expect_refused("birdseye", "calibrate camera --images x.png" + end, {"--board"}, out);
  std::ofstream(scratch / "p/image_points.1.txt", std::ios::app) << "3 x\n";
  expect_refused("birdseye", "calibrate camera --size 1920x1080 --points " + points + end,
                 {"image_points.1.txt", "'x' is not a number"}, out);
  fs::remove(scratch / "p/object_points.0.txt");
  expect_refused("birdseye", "calibrate camera --size 1920x1080 --points " + points + end, {"object_points.0.txt"},
                 out);
}

}  // namespace
}  // namespace birdseye
