#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "host/recording/recording_writer.hpp"
#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::contents_of;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_ct;

constexpr const char* kIdentityPose = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
constexpr const char* kReplayCamera =
    "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: "
    "d\n   data: [ 60., 0., 32., 0., 60., 24., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   "
    "cols: 5\n   dt: d\n   data: [ -0.1, 0., 0., 0., 0. ]\n";
constexpr int kFrames = 24, kLost = 12;

/// small_ct's ball, which the pointer touches at four places, then the scope looks at from 80 mm; from frame kLost on
/// there is no pose.
void record(const fs::path& folder) {
  auto writer = host::RecordingWriter::create({.folder = folder, .source = "test"});
  ASSERT_TRUE(writer) << writer.error().what;
  std::int64_t ns = 1'000'000'000;
  const auto pointer_at = [&](const Eigen::Vector3d& place, double seconds) {
    for (int n = 0; n < seconds * 100; ++n, ns += 10'000'000) {
      const Transform<Tracker, Sensor> pose(Eigen::Matrix3d::Identity(), place);
      ASSERT_TRUE((*writer)->add(wire::Birds{{ns}, {{"pointer", pose}}}));
    }
  };
  const std::vector<Eigen::Vector3d> places = {{100, 0, 0}, {0, 0, 0},   {30, 0, 0},
                                               {0, 50, 0},  {10, 0, 70}, {100, 0, 0}};
  for (std::size_t i = 0; i < places.size(); ++i) {
    pointer_at(places[i], 0.8);
    for (int n = 1; i + 1 < places.size() && n < 20; ++n)
      pointer_at(places[i] + (places[i + 1] - places[i]) * (n / 20.0), 0.02);
  }
  for (int n = 0; n < kFrames; ++n) {
    wire::VideoFrame frame;
    frame.info.sequence = static_cast<std::uint64_t>(n) + 7;
    frame.info.acquired = frame.info.arrived = {ns + 40'000'000 * n};
    frame.width_px = 64;
    frame.height_px = 48;
    frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3 * 64 * 48, static_cast<std::uint8_t>(20 + n));
    if (n < kLost) {
      frame.info.pose.kind = PoseKind::interpolated;
      frame.info.pose.tracker_from_sensor =
          Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), Eigen::Vector3d(0.3 * n, 0, -80));
    } else {
      frame.info.pose.reason = "the tracker is silent";
    }
    ASSERT_TRUE((*writer)->add(frame));
  }
  ASSERT_TRUE((*writer)->finish("done"));
}

/// The bytes of every file in a folder, by name.
std::map<std::string, std::string> contents(const fs::path& folder) {
  std::map<std::string, std::string> out;
  for (const auto& entry : fs::directory_iterator(folder)) out[entry.path().filename()] = contents_of(entry.path());
  return out;
}

std::string inputs(const Scratch& scratch, const std::string& ct) {
  return "replay " + (scratch / "r").string() + " --volume " + ct + " --transfer abdomen --camera " +
         scratch.file("camera.yaml", kReplayCamera) + " --camera-from-sensor " +
         scratch.file("hand_eye.txt", kIdentityPose);
}

TEST(ReplayCommand, TwoReplaysAreTheSameToTheBit) {
  const Scratch scratch;
  record(scratch / "r");
  const std::string arguments = inputs(scratch, small_ct(scratch)) + " --registration " +
                                scratch.file("reg.txt", kIdentityPose) + " --every 4 --out ";
  for (const char* name : {"a", "b"}) {
    const auto result = run("birdseye", arguments + (scratch / name).string());
    ASSERT_EQ(result.code, 0) << result.output;
  }
  const auto a = contents(scratch / "a"), b = contents(scratch / "b");
  EXPECT_EQ(a.size(), 6U + 3U);  // pictures; frames.csv, replay.json, patient_from_tracker.txt
  EXPECT_TRUE(a == b);
  const auto json = nlohmann::json::parse(a.at("replay.json"));
  EXPECT_EQ(json["frames"], kFrames);
  EXPECT_EQ(json["frames_overlaid"], kLost);
  EXPECT_EQ(json["reasons_of_frames"]["the tracker is silent"], kFrames - kLost);
  EXPECT_EQ(json["verdict"], "marginal");
  // Without a pose there is the video and nothing else; with one there is the ball.
  const auto row = [&](int n) {
    std::istringstream table(a.at("frames.csv"));
    std::string line;
    for (int i = -1; i <= n; ++i) std::getline(table, line);
    return line;
  };
  EXPECT_NE(row(0).find("7,"), std::string::npos);
  EXPECT_NE(row(0).find(",interpolated,1,,1 0 0"), std::string::npos) << row(0);
  EXPECT_NE(row(kLost).find(",refused,0,the tracker is silent,"), std::string::npos) << row(kLost);
  EXPECT_GT(a.at("overlay-000007.png").size(), 2 * a.at("overlay-000023.png").size());
}

TEST(ReplayCommand, RegistersAnewByTheTouchesInTheRecording) {
  const Scratch scratch;
  record(scratch / "r");
  // The markers 5 mm to the side of where they were touched, in another order.
  const auto result = run("birdseye", inputs(scratch, small_ct(scratch)) + " --fiducials " +
                                          scratch.file("ct.txt", "5 50 0\n5 0 0\n15 0 70\n35 0 0\n") + " --tip " +
                                          scratch.file("tip.txt", "0 0 0\n") + " --out " + (scratch / "o").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const auto json = read_json(scratch / "o/replay.json");
  EXPECT_EQ(json["touches"], 4);
  EXPECT_LT(json["fre_mm"], 0.5);
  std::istringstream pose(contents_of(scratch / "o/patient_from_tracker.txt"));
  std::vector<double> numbers(16);
  for (double& number : numbers) pose >> number;
  EXPECT_NEAR(numbers[0], 1, 1e-2);
  EXPECT_NEAR(numbers[3], 5, 0.5);
}

TEST(ReplayCommand, WhatCannotBeReplayedIsRefused) {
  const Scratch scratch;
  record(scratch / "r");
  const std::string ct = small_ct(scratch), all = inputs(scratch, ct);
  const std::string out = " --out " + (scratch / "o").string();
  const std::string registration = " --registration " + scratch.file("reg.txt", kIdentityPose);
  const auto refused = [&](const std::string& arguments, const std::vector<std::string>& words) {
    expect_refused("birdseye", arguments + out, words, scratch / "o");
  };
  refused(all, {"give one registration"});
  refused(all + registration + " --tracker-from-patient " + scratch.file("t.txt", kIdentityPose),
          {"give one registration"});
  refused("replay " + (scratch / "r").string() + " --volume " + ct + registration, {"no calibration was in force"});
  refused("replay " + (scratch / "none").string() + " --volume " + ct + registration, {"none", "no such recording"});
  refused("replay " + ct + " --volume " + ct + registration, {"holds no recording"});
  refused(all + " --fiducials " + scratch.file("f.txt", "0 0 0\n1 0 0\n0 1 0\n"), {"--tip"});
  refused(all + registration + " --deformation " + (scratch / "none.mha").string(), {"none.mha"});
}

}  // namespace
}  // namespace birdseye
