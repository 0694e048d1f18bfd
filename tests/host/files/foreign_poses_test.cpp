// Poses in one file as other programs write them: matrices one below another, exports of Motive, binary arrays.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "host/files/pose_files.hpp"
#include "host/files/text_files.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;

constexpr const char* kTurnedRows = "0 -1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n";
constexpr const char* kPlainRows = "1 0 0 4\n0 1 0 5\n0 0 1 6\n0 0 0 1\n";

std::string lines_of(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += text + "\n";
  return out;
}

Result<PoseSet> read_foreign(const std::string& text, const PoseReading& how = {}) {
  const Scratch scratch;
  return read_pose_set(scratch.file("poses.csv", text), how);
}

void expect_foreign_refused(const std::string& text, const std::string& words, const PoseReading& how = {}) {
  const auto set = read_foreign(text, how);
  ASSERT_FALSE(set) << words;
  EXPECT_NE(set.error().what.find(words), std::string::npos) << set.error().what;
}

/// A quarter turn about z at 1, 2, 3, then none at 4, 5, 6.
void expect_both(const Result<PoseSet>& set) {
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 2U) << lines_of(set->rejected);
  EXPECT_LT((set->poses[0].tracker_from_sensor * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm(), 1e-5);
  EXPECT_LT((set->poses[1].tracker_from_sensor * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(5, 5, 6)).norm(), 1e-5);
}

TEST(ForeignPoses, MatricesOneBelowAnother) {
  const std::string two = std::string(kTurnedRows) + kPlainRows;
  expect_both(read_foreign(two));
  expect_both(read_foreign("# as saved\n" + std::string(kTurnedRows) + "\n" + kPlainRows));
  std::string commas = two;
  std::replace(commas.begin(), commas.end(), ' ', ',');
  expect_both(read_foreign(commas));
  expect_both(read_foreign("0 1 0 0\n-1 0 0 0\n0 0 1 0\n1 2 3 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n4 5 6 1\n",
                           {.column_major = true}));
}

TEST(ForeignPoses, AMatrixBelowAnotherThatIsNoneKeepsItsPlace) {
  const auto set = read_foreign(std::string(kTurnedRows) +
                                "nan nan nan nan\nnan nan nan nan\nnan nan nan nan\n0 0 0 1\n" + kPlainRows);
  expect_both(set);
  EXPECT_EQ(set->poses[1].index, 2U);
  EXPECT_EQ(lines_of(set->rejected), "the matrix up to line 8: not finite\n");
}

TEST(ForeignPoses, MatricesOneBelowAnotherThatAreCutOffOrHaveThreeRowsAreRefused) {
  expect_foreign_refused(std::string(kTurnedRows) + "1 0 0 4\n0 1 0 5\n0 0 1 6\n", "holds 7 rows of four numbers");
  expect_foreign_refused("0 -1 0 1\n1 0 0 2\n0 0 1 3\n1 0 0 4\n", "0 0 0 1 below three");
  expect_foreign_refused("0.1 0.2 0.3 0.9\n0.2 0.3 0.4 0.8\n0.1 0.2 0.3 0.9\n0.2 0.3 0.4 0.8\n",
                         "no rotation (rows of four numbers are read as matrices one below another");
  expect_foreign_refused("0 1 0 0\n-1 0 0 0\n0 0 1 0\n1 2 3 1\n", "it is written column by column: say --column-major");
}

TEST(ForeignPoses, AMirrorIsSaidToBeOne) {
  expect_foreign_refused("0 1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n", "no rotation but a mirror (determinant -1)");
  expect_foreign_refused("1 0 0 1 0 1 0 2 0 0 -1 3 0 0 0 1\n", "write a right-handed frame");
}

TEST(ForeignPoses, APoseOfAViewThatIsAMirrorOrWrittenByColumnsIsSaidToBe) {
  const Scratch scratch;
  const auto mirror = read_pose(scratch.file("mirror.txt", "0 1 0 1\n1 0 0 2\n0 0 1 3\n0 0 0 1\n"));
  ASSERT_FALSE(mirror);
  EXPECT_NE(mirror.error().what.find("mirror.txt: is a mirror (determinant -1)"), std::string::npos);
  const auto columns = read_pose(scratch.file("columns.txt", "0 1 0 0\n-1 0 0 0\n0 0 1 0\n1 2 3 1\n"));
  ASSERT_FALSE(columns);
  EXPECT_NE(columns.error().what.find("columns.txt: is written column by column"), std::string::npos);
  EXPECT_TRUE(read_pose(scratch.file("right.txt", kTurnedRows)));
}

TEST(ForeignPoses, BinaryArraysAreRefusedWithTheRemedy) {
  expect_foreign_refused(std::string("\x93NUMPY\x01\0v\0{'descr': '<f8'}\n", 25), "numpy.savetxt");
  expect_foreign_refused("MATLAB 5.0 MAT-file, Platform: GLNXA64\n", "a file of MATLAB");
}

struct MotiveTake {
  std::string turns = "Quaternion", unit = "Meters", space = "Global", second = "Scope";
  bool parent = false;  ///< a line that Motive 3 has

  /// The two poses of the pointer, in metres, and of what is called second.
  [[nodiscard]] std::string text() const {
    std::string out =
        fmt::format("Format Version,1.23,Take Name,Take 1,Rotation Type,{},Length Units,{},Coordinate Space,{}\n\n",
                    turns, unit, space);
    out += ",Type";
    for (int i = 0; i < 16; ++i) out += ",Rigid Body";
    out += ",Rigid Body Marker,Rigid Body Marker,Rigid Body Marker\n,Name";
    for (int i = 0; i < 8; ++i) out += ",Pointer";
    for (int i = 0; i < 8; ++i) out += "," + second;
    out += ",Pointer:1,Pointer:1,Pointer:1\n,ID,\"A\",\"A\",\"A\",\"A\",\"A\",\"A\",\"A\",\"A\"\n";
    if (parent) out += ",Parent,,,,\n";
    const std::string body = ",Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error";
    out +=
        "," + body + body + ",Position,Position,Position\nFrame,Time (Seconds),X,Y,Z,W,X,Y,Z,,X,Y,Z,W,X,Y,Z,,X,Y,Z\n";
    out += "0,0.000,0,0,0.7071068,0.7071068,0.001,0.002,0.003,0.0002,0,0,0,1,9,9,9,0.001,1,1,1\n";
    out += "1,0.008,,,,,,,,,0,0,0,1,9,9,9,0.001,1,1,1\n";
    out += "2,0.016,0,0,0,1,0.004,0.005,0.006,0.0004,,,,,,,,,,,\n";
    return out;
  }
};

TEST(ForeignPoses, AnExportOfMotive) {
  for (const bool parent : {false, true}) {
    const auto set = read_foreign(MotiveTake{.parent = parent}.text(), {.transform = "pointer"});
    expect_both(set);
    EXPECT_TRUE(set->timed);
    EXPECT_TRUE(set->direction_known);
    EXPECT_NEAR(set->poses[1].time_s, 0.016, 1e-9);
    ASSERT_TRUE(set->poses[1].error_mm);
    EXPECT_NEAR(*set->poses[1].error_mm, 0.4, 1e-9);
    EXPECT_EQ(set->rejected.size(), 1U) << lines_of(set->rejected);
    EXPECT_NE(lines_of(set->notes).find("OptiTrack Motive: the poses of its rigid body Pointer are read"),
              std::string::npos);
    EXPECT_NE(lines_of(set->notes).find("its lengths are in metres"), std::string::npos) << lines_of(set->notes);
  }
  const auto millimetres = read_foreign(MotiveTake{.unit = "Millimeters"}.text(), {.transform = "Pointer"});
  ASSERT_TRUE(millimetres) << millimetres.error().what;
  EXPECT_NEAR(millimetres->poses[0].tracker_from_sensor.translation().z(), 0.003, 1e-9);
}

TEST(ForeignPoses, AnExportOfMotiveThatDoesNotSayEnoughIsRefused) {
  const PoseReading pointer{.transform = "Pointer"};
  expect_foreign_refused(MotiveTake{}.text(),
                         "say whose poses are meant by --tool NAME; it is an export of OptiTrack Motive, with the "
                         "rigid bodies Pointer, Scope");
  expect_foreign_refused(MotiveTake{}.text(), "has no tool Hook", {.transform = "Hook"});
  expect_foreign_refused(MotiveTake{.turns = "XYZ"}.text(), "Rotation Type Quaternion", pointer);
  expect_foreign_refused(MotiveTake{.space = "Local"}.text(), "Coordinate Space Global", pointer);
  expect_foreign_refused(MotiveTake{.unit = "Furlongs"}.text(), "export it in meters", pointer);
  expect_foreign_refused(MotiveTake{.unit = ""}.text(), "names no unit of its lengths: say it, --unit m", pointer);
  expect_foreign_refused(MotiveTake{.second = "Pointer"}.text(), "two rigid bodies called Pointer");
  expect_foreign_refused("Format Version,1.23,Take Name,Take 1\n0,0,1\n", "without the line of columns");
}

}  // namespace
}  // namespace birdseye::host
