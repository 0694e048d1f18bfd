#include "host/files/pose_files.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "tests/support/data.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

namespace fs = std::filesystem;
using testing::Scratch;

const std::string kTurned = "0 -1 0 10\n1 0 0 20\n0 0 1 30\n0 0 0 1\n";

std::string all_of(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += text + "\n";
  return out;
}

void write(const Scratch& scratch, const std::string& name, const std::string& text) {
  std::ofstream(scratch / name) << text;
}

/// A sequence as PLUS writes it, with lines of frames given whole.
std::string sequence(const std::vector<std::string>& fields) {
  std::string text = "ObjectType = Image\nNDims = 3\n";
  for (const std::string& field : fields) text += "Seq_Frame" + field + "\n";
  return text + "ElementDataFile = LOCAL\n\x01\x02Seq_Frame0099_StylusToTrackerTransform = no\n";
}

const std::string kPose = "0 -1 0 10 1 0 0 20 0 0 1 30 0 0 0 1";

TEST(PoseFiles, AFolderOfMatricesIsReadInTheOrderOfItsNumbers) {
  const Scratch scratch;
  for (const int n : {10, 9, 2}) write(scratch, fmt::format("pose.{}.txt", n), fmt::format("# {}\n{}", n, kTurned));
  write(scratch, "other.txt", kTurned);
  write(scratch, "README.md", "words");
  const auto some = read_pose_set(scratch / "pose.*.txt");
  ASSERT_TRUE(some) << some.error().what;
  ASSERT_EQ(some->poses.size(), 3U);
  EXPECT_FALSE(some->timed);
  EXPECT_EQ(some->poses[0].name, "pose.2.txt");
  EXPECT_EQ(some->poses[1].name, "pose.9.txt");
  EXPECT_EQ(some->poses[2].name, "pose.10.txt");
  EXPECT_EQ(some->poses[2].index, 2U);
  EXPECT_EQ(some->poses[0].tracker_from_sensor * Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(10, 21, 30));
  EXPECT_NE(all_of(some->notes).find("2 of 3 poses repeat"), std::string::npos);
  EXPECT_EQ(read_pose_set(scratch.path())->poses.size(), 4U);
  // Metres.
  EXPECT_EQ(read_pose_set(scratch.path(), {.mm_per_unit = 1000})->poses[0].tracker_from_sensor.translation().x(),
            10000);
}

TEST(PoseFiles, NamesOfNanosecondsAreTimes) {
  const Scratch scratch;
  write(scratch, "1378476418747859600.txt", kTurned);
  write(scratch, "1378476417807806000.txt", kTurned);
  const auto set = read_pose_set(scratch.path());
  ASSERT_TRUE(set);
  EXPECT_TRUE(set->timed);
  EXPECT_NEAR(set->poses[1].time_s - set->poses[0].time_s, 0.9400536, 1e-6);
}

TEST(PoseFiles, WhatIsNoPoseInAFolderIsRejectedByName) {
  const Scratch scratch;
  const auto with = [](const std::string& what, const std::string& by) {
    std::string text = kTurned;
    return text.replace(text.find(what), what.size(), by);
  };
  write(scratch, "01.txt", kTurned);
  write(scratch, "02.txt", with("30", "nan"));
  write(scratch, "03.txt", with("30", "-3.697314E28"));
  write(scratch, "04.txt", with("-1", "-1.2"));
  write(scratch, "05.txt", with("0 0 1 ", "0 0 -1 "));
  write(scratch, "06.txt", "0 0 0 1");
  write(scratch, "07.txt", "missing\n");
  write(scratch, "08.txt", "");
  write(scratch, "09.txt", with("0 0 0 1", "0 0 0 2"));
  write(scratch, "10.txt", with("20", "two"));
  write(scratch, "11.txt", with("20", "1e999"));
  const auto set = read_pose_set(scratch.path());
  ASSERT_TRUE(set);
  ASSERT_EQ(set->poses.size(), 1U);
  ASSERT_EQ(set->rejected.size(), 10U) << all_of(set->rejected);
  const std::vector<std::string> expected{"02.txt: not finite",
                                          "03.txt: -3.69731e+28 mm is no position",
                                          "04.txt: no rotation",
                                          "05.txt: no rotation but a mirror",
                                          "06.txt: 4 numbers where",
                                          "07.txt: missing",
                                          "08.txt: missing",
                                          "09.txt: its last row",
                                          "10.txt: \"two\" is no number",
                                          "11.txt: not finite"};
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_TRUE(set->rejected[i].starts_with(expected[i])) << set->rejected[i];
}

TEST(PoseFiles, MillimetresTakenForMetresAreToldByTheirUnit) {
  const Scratch scratch;
  PoseReading metres;
  metres.mm_per_unit = 1000;
  const auto set = read_pose_set(
      scratch.file("p.csv", "0,0.1,0.2,0.3,0,0,0,1\n1,515.266,2,3,0,0,0,1\n2,-3.697314E28,2,3,0,0,0,1\n"), metres);
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->rejected.size(), 2U) << all_of(set->rejected);
  EXPECT_NE(set->rejected[0].find("515266 mm is no position; 515.266 mm is one: the unit of lengths (--unit"),
            std::string::npos)
      << set->rejected[0];
  EXPECT_NE(set->rejected[1].find("a stand-in for a missing one"), std::string::npos) << set->rejected[1];
}

TEST(PoseFiles, ACsvMayHaveAHeaderRemarksAndAnyOfThreeSeparators) {
  const Scratch scratch;
  for (const std::string& text :
       {std::string("# a remark\n0.5, 1, 2, 3, 0, 0, 0.7071068, 0.7071068\n1.5,4,5,6,0,0,0,1\n"),
        std::string("\xEF\xBB\xBFt,x,y,z,qx,qy,qz,qw\r\n0.5,1,2,3,0,0,0.7071068,0.7071068\r\n1.5,4,5,6,0,0,0,1\r\n"),
        std::string("time_s;qw;qx;qy;qz;x_mm;y_mm;z_mm;remark\n0.5;0.7071068;0;0;0.7071068;1;2;3;good\n"
                    "1.5;1;0;0;0;4;5;6;\n"),
        std::string("0.5 1 2 3 0 0 0.7071068 0.7071068\n\n1.5 4 5 6 0 0 0 1")}) {
    const auto set = read_pose_set(scratch.file("p.csv", text));
    ASSERT_TRUE(set) << set.error().what;
    ASSERT_EQ(set->poses.size(), 2U) << text << all_of(set->rejected);
    EXPECT_TRUE(set->timed);
    EXPECT_EQ(set->poses[0].time_s, 0.5);
    EXPECT_LT((set->poses[0].tracker_from_sensor * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm(), 1e-6);
    EXPECT_EQ(set->poses[1].tracker_from_sensor.translation(), Eigen::Vector3d(4, 5, 6));
  }
}

TEST(PoseFiles, RowsOfACsvThatAreNoPosesAreRejectedByLine) {
  const Scratch scratch;
  const auto set = read_pose_set(scratch.file("p.csv",
                                              "0,1,2,3,0,0,0,1\n"
                                              "1,nan,2,3,0,0,0,1\n"
                                              "2,1,2,3,0,0,0,1.1\n"
                                              "3,1,2,3,0,0,0,0\n"
                                              "4,1,2,3,0,0,1\n"
                                              "5,missing\n"
                                              "6,,,,,,,\n"
                                              "7,-3.697314E28,2,3,0,0,0,1\n"
                                              "0.5,1,2,3,0,0,0,1\n"
                                              "0,1,2,4,0,0,0,1\n"
                                              "inf,1,2,3,0,0,0,1\n"));
  ASSERT_TRUE(set);
  ASSERT_EQ(set->poses.size(), 2U);
  const std::vector<std::string> expected{"line 2: not finite",
                                          "line 3: its quaternion has length 1.1",
                                          "line 4: its quaternion has length 0",
                                          "line 5: 7 numbers where a row has 8",
                                          "line 6: missing",
                                          "line 7: missing",
                                          "line 8: -3.69731e+28",
                                          "line 11: not finite",
                                          "line 10: has the time of line 1"};
  ASSERT_EQ(set->rejected.size(), expected.size()) << all_of(set->rejected);
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_TRUE(set->rejected[i].starts_with(expected[i])) << set->rejected[i];
  EXPECT_NE(all_of(set->notes).find("times go back after line 9"), std::string::npos) << all_of(set->notes);
  EXPECT_EQ(set->poses[1].name, "line 9");
}

TEST(PoseFiles, OnlyFramesOfASequenceThatAreOkAreRead) {
  const Scratch scratch;
  const std::string path = scratch.file(
      "s.mha", sequence({"0000_StylusToTrackerTransform = " + kPose, "0000_StylusToTrackerTransformStatus = OK",
                         "0000_Timestamp = 1.5", "0000_UnfilteredTimestamp = 1.625",
                         "0001_StylusToTrackerTransform = " + kPose, "0001_StylusToTrackerTransformStatus = INVALID",
                         "0001_Timestamp = 2.5", "0002_Timestamp = 3.5", "0003_StylusToTrackerTransform = " + kPose,
                         "0003_StylusToTrackerTransformStatus = MISSING", "0003_Timestamp = 4",
                         "0004_StylusToTrackerTransform = " + kPose, "0004_StylusToTrackerTransformStatus = OK"}));
  const auto set = read_pose_set(path);
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 1U);
  EXPECT_EQ(set->poses[0].name, "frame 0");
  EXPECT_EQ(set->poses[0].time_s, 1.5);
  EXPECT_EQ(set->poses[0].unfiltered_time_s, 1.625);
  EXPECT_EQ(all_of(set->rejected), "frame 1: INVALID\nframe 2: missing\nframe 3: MISSING\nframe 4: has no time\n");
}

TEST(PoseFiles, AnNrrdWithoutTimesCounts) {
  const Scratch scratch;
  const auto set = read_pose_set(
      scratch.file("s.nrrd", "NRRD0004\nSeq_Frame0007_ProbeToTrackerTransform:=" + kPose + "\n\nSeq_Frame0008_X:=1\n"));
  ASSERT_TRUE(set) << set.error().what;
  EXPECT_FALSE(set->timed);
  EXPECT_EQ(set->poses[0].index, 7U);
  EXPECT_EQ(set->poses[0].time_s, 7);
}

TEST(PoseFiles, ASequenceThatSaysAFieldTwiceDifferentlyIsRefusedByItsName) {
  const Scratch scratch;
  const std::string pose = "0000_StylusToTrackerTransform = ", other = "0 -1 0 65 1 0 0 20 0 0 1 30 0 0 0 1";
  EXPECT_TRUE(read_pose_set(scratch.file("alike.mha", sequence({pose + kPose, pose + kPose}))));
  const auto of_frame = read_pose_set(scratch.file("frame.mha", sequence({pose + kPose, pose + other})));
  ASSERT_FALSE(of_frame);
  EXPECT_NE(of_frame.error().what.find("frame.mha: has Seq_Frame0000_StylusToTrackerTransform twice"),
            std::string::npos)
      << of_frame.error().what;
  const auto of_all = read_pose_set(scratch.file("all.mha", "NDims = 2\n" + sequence({pose + kPose})));
  ASSERT_FALSE(of_all);
  EXPECT_NE(of_all.error().what.find("all.mha: has NDims twice"), std::string::npos) << of_all.error().what;
  const std::string remarks = "NRRD0004\n# by = one\n# by = two\n";
  const auto remarked =
      read_pose_set(scratch.file("s.nrrd", remarks + "Seq_Frame0007_ProbeToTrackerTransform:=" + kPose + "\n\n"));
  ASSERT_TRUE(remarked) << remarked.error().what;
}

TEST(PoseFiles, OneSensorAgainstAnother) {
  const Scratch scratch;
  const std::string path = scratch.file(
      "s.mha", sequence({"0000_StylusToTrackerTransform = " + kPose,
                         "0000_ReferenceToTrackerTransform = 0 -1 0 9 1 0 0 20 0 0 1 30 0 0 0 1",
                         "0001_StylusToTrackerTransform = " + kPose, "0001_ReferenceToTrackerTransform = " + kPose,
                         "0001_ReferenceToTrackerTransformStatus = INVALID"}));
  const auto set = read_pose_set(path, {"StylusToTracker", "ReferenceToTrackerTransform"});
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 1U);
  EXPECT_EQ(set->poses[0].tracker_from_sensor.translation(), Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(all_of(set->rejected), "frame 1: ReferenceToTracker INVALID\n");
  EXPECT_TRUE(read_pose_set(path, {"", "ReferenceToTracker"}));
  EXPECT_FALSE(read_pose_set(path, {"StylusToTracker", "StylusToTracker"}));
}

TEST(PoseFiles, RefusalsSayWhatToDo) {
  const Scratch scratch;
  const std::string two =
      scratch.file("two.mha", sequence({"0000_AToTrackerTransform = " + kPose, "0000_BToTrackerTransform = " + kPose}));
  fs::create_directory(scratch / "empty");
  for (const auto& [path, transform, words] :
       {std::tuple{two, std::string(), "--transform); it holds AToTracker, BToTracker"},
        {two, std::string("CToTracker"), "has no transform CToTracker; it holds AToTracker, BToTracker"},
        {scratch.file("none.mha", sequence({})), std::string(), "holds no transforms"},
        {scratch.file("e.csv", ""), std::string(), "holds no poses"},
        {scratch.file("h.csv", "t,x,y,z,qx,qy,qz\n"), std::string(), "its header lacks qw"},
        {scratch.file("b.csv", "0,1\n"), std::string(), "its one pose cannot be used; line 1: 2 numbers"},
        {(scratch / "no.csv").string(), std::string(), "no such file"},
        {(scratch / "empty").string(), std::string(), "has no files *.txt"}}) {
    const auto set = read_pose_set(path, {transform});
    ASSERT_FALSE(set) << path;
    EXPECT_NE(set.error().what.find(words), std::string::npos) << set.error().what;
    EXPECT_EQ(set.error().what.find(path), 0U) << set.error().what;
  }
}

class RecordedPoses : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto found = birdseye::testing::data_dir();
    if (!found) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
    data = *found;
  }
  fs::path data;
};

TEST_F(RecordedPoses, AnInvalidFrameOfARealSequenceIsNamed) {
  const fs::path path = data / "em_tracker_sequences/TransformInterpolationTest.igs.mha";
  const auto probe = read_pose_set(path, {"ProbeToTracker"});
  ASSERT_TRUE(probe) << probe.error().what;
  EXPECT_EQ(probe->poses.size(), 499U);
  EXPECT_EQ(all_of(probe->rejected), "frame 7: INVALID\n");
  EXPECT_EQ(read_pose_set(path, {"ReferenceToTracker"})->poses.size(), 500U);
  const auto relative = read_pose_set(path, {"ProbeToTracker", "ReferenceToTracker"});
  EXPECT_EQ(relative->poses.size(), 499U);
  EXPECT_EQ(all_of(relative->rejected), "frame 7: ProbeToTracker INVALID\n");
}

TEST_F(RecordedPoses, JitteredStampsAreKeptBesideTheFilteredOnes) {
  const auto set = read_pose_set(data / "em_tracker_sequences/WaterTankBottomTranslationTrackerBuffer-trimmed.igs.mha",
                                 {"StylusToTracker"});
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 801U);
  double least_s = 1, least_unfiltered_s = 1, most_unfiltered_s = 0;
  for (std::size_t i = 1; i < set->poses.size(); ++i) {
    least_s = std::min(least_s, set->poses[i].time_s - set->poses[i - 1].time_s);
    const double raw_s = set->poses[i].unfiltered_time_s - set->poses[i - 1].unfiltered_time_s;
    least_unfiltered_s = std::min(least_unfiltered_s, raw_s);
    most_unfiltered_s = std::max(most_unfiltered_s, raw_s);
  }
  EXPECT_NEAR(least_unfiltered_s, 0.002, 1e-6);
  EXPECT_NEAR(most_unfiltered_s, 0.075, 1e-3);
  EXPECT_GT(least_s, 0.018);
}

TEST_F(RecordedPoses, OthersAreReadWhole) {
  EXPECT_EQ(read_pose_set(data / "pivot_optical_pointer")->poses.size(), 57U);
  const auto arm =
      read_pose_set(data / "handeye_pose_streams/robot_arm_complete_bag_color_and_ir_base_link_sr300_hinge.csv",
                    {.mm_per_unit = 1000});
  ASSERT_TRUE(arm) << arm.error().what;
  EXPECT_EQ(arm->poses.size(), 2817U);
  EXPECT_TRUE(arm->rejected.empty());
  EXPECT_NEAR(arm->poses[0].tracker_from_sensor.translation().x(), 617.706133479, 1e-9);
  EXPECT_EQ(
      read_pose_set(data / "handeye_pose_streams/robot_arm_complete_bag_color_and_ir_target_ir.csv")->poses.size(),
      1703U);
  EXPECT_EQ(read_pose_set(data / "laparoscope_charuco_handeye/calib.device_tracking.*.txt")->poses.size(), 6U);
}

}  // namespace
}  // namespace birdseye::host
