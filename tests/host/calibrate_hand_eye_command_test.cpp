// `calibrate hand-eye`, from the outside.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using ::testing::HasSubstr;
using testing::run;
using testing::Scratch;

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
