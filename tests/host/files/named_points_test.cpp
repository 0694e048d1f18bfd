#include "host/files/named_points.hpp"

#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using Names = std::vector<std::string>;

const std::string kFcsv =
    "# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n"
    "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
    "vtkMRMLMarkupsFiducialNode_0,-1.5,-2,3,0,0,0,1,1,1,0,left ear,,\n"
    "vtkMRMLMarkupsFiducialNode_1,-4,-5,6,0,0,0,1,1,1,0,right ear,,\n";

std::string markups(const std::string& frame, const std::string& unit = "mm", const std::string& status = "defined") {
  return R"({"markups": [{"type": "Fiducial", "coordinateSystem": ")" + frame + R"(", "coordinateUnits": ")" + unit +
         R"(", "controlPoints": [{"id": "1", "label": "left ear", "position": [1.5, 2, 3], "positionStatus": "defined"},)"
         R"({"id": "2", "label": "right ear", "position": [4, 5, 6], "positionStatus": ")" +
         status + R"("}]}]})";
}

TEST(NamedPoints, TablesOfAllKindsAreTheSamePoints) {
  const testing::Scratch scratch;
  const std::vector<std::pair<std::string, std::string>> files{
      {"plain.txt", "1.5 2 3\n4 5 6\n"},
      {"remark.txt", "# x y z, mm, LPS\r\n1.5 2 3 # left ear\r\n4, 5, 6\r\n"},
      {"named.txt", "left ear 1.5 2 3\nright ear 4 5 6\n"},
      {"behind.csv", "1.5,2,3,left ear\n4,5,6,right ear\n"},
      {"header.csv", "\xEF\xBB\xBFid,Name,X,Y,Z,note\n1,left ear,1.5,2,3,sharp\n2,right ear,4,5,6,\n"},
      {"metres.csv", "name;x [m];y [m];z [m]\nleft ear;0,0015;0,002;0,003\nright ear;0,004;0,005;0,006\n"},
      {"ras.csv", "label,r,a,s\nleft ear,-1.5,-2,3\nright ear,-4,-5,6\n"},
      {"counted.txt", "1 1.5 2 3\n2 4 5.0 6\n"},
      {"comma.txt", "1,5 2,0 3,0\n4,0 5,0 6,0\n"},
      {"spreadsheet.csv", "1,5;2;3\n4;5;6\n"},
      {"slicer.fcsv", kFcsv},
      {"slicer.mrk.json", markups("LPS")}};
  for (const auto& [name, text] : files) {
    const auto read = read_named_points(scratch.file(name, text), PointsOf::patient);
    ASSERT_TRUE(read) << name << ": " << read.error().what;
    ASSERT_EQ(read->places_mm.size(), 2U) << name;
    EXPECT_LT((read->places_mm[0] - Eigen::Vector3d(1.5, 2, 3)).norm(), 1e-12) << name;
    EXPECT_LT((read->places_mm[1] - Eigen::Vector3d(4, 5, 6)).norm(), 1e-12) << name;
    const bool nameless =
        name == "plain.txt" || name == "remark.txt" || name == "comma.txt" || name == "spreadsheet.csv";
    const Names names = name == "counted.txt" ? Names{"1", "2"} : Names{"left ear", "right ear"};
    EXPECT_EQ(read->names, nameless ? Names{} : names) << name;
  }
}

TEST(NamedPoints, AStatedFrameIsTurnedIntoTheOneThatIsAskedFor) {
  const testing::Scratch scratch;
  const std::string lps = scratch.file("lps.mrk.json", markups("LPS")),
                    ras = scratch.file("ras.mrk.json", markups("RAS"));
  const Eigen::Vector3d as_is(1.5, 2, 3), turned(-1.5, -2, 3);
  EXPECT_EQ((*read_points(lps, PointsOf::patient))[0], as_is);
  EXPECT_EQ((*read_points(ras, PointsOf::patient))[0], turned);
  EXPECT_EQ((*read_points(lps, PointsOf::tracker))[0], turned);
  EXPECT_EQ((*read_points(ras, PointsOf::tracker))[0], as_is);
  EXPECT_FALSE(read_points(lps, PointsOf::sensor));
  const auto told = read_named_points(ras, PointsOf::patient);
  ASSERT_EQ(told->notes.size(), 1U);
  EXPECT_NE(told->notes[0].find("are in RAS, and are turned to LPS"), std::string::npos);
}

TEST(NamedPoints, AFrameThatIsSaidTwiceAlikeIsOne) {
  const testing::Scratch scratch;
  const auto read = read_points(scratch.file("a.fcsv", "# CoordinateSystem = 0\n" + kFcsv), PointsOf::patient);
  ASSERT_TRUE(read) << read.error().what;
  EXPECT_EQ((*read)[0], Eigen::Vector3d(1.5, 2, 3));
}

TEST(NamedPoints, PointsWithoutAPlaceYetArePassedOver) {
  const testing::Scratch scratch;
  const auto read = read_named_points(scratch.file("a.mrk.json", markups("LPS", "mm", "undefined")), PointsOf::patient);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->places_mm.size(), 1U);
  EXPECT_NE(read->notes.at(0).find("\"right ear\" has no place yet"), std::string::npos);
}

TEST(NamedPoints, NamesThatStandTwiceAreNone) {
  const testing::Scratch scratch;
  const auto read = read_named_points(scratch.file("a.txt", "ear 1 2 3\near 4 5 6\n"), PointsOf::patient);
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->names.empty());
  ASSERT_EQ(read->notes.size(), 1U);
  EXPECT_NE(read->notes[0].find("\"ear\" is the name of more than one point"), std::string::npos) << read->notes[0];
}

TEST(NamedPoints, WhatIsNoListOfPointsIsRefusedWithTheRemedy) {
  const testing::Scratch scratch;
  const std::vector<std::array<std::string, 3>> files{
      {"two.txt", "1 2\n", "line 1: 2 numbers where a point has three; give x y z"},
      {"four.txt", "1 2 3\n1 2 3 4\n", "line 2: 4 numbers where a point has three; give x y z"},
      {"count.txt", "1 1.5 2 3\n1 4.5 5 6\n", "line 2: the lines begin with a number that counts the points"},
      {"uncounted.txt", "1 1.5 2 3\n4.5 5 6\n", "line 2: the lines begin with a number that counts the points"},
      {"words.txt", "once upon a time\n", "name,x,y,z"},
      {"nan.txt", "nan 1 2\n", "line 1: \"nan\" is not finite"},
      {"far.txt", "1 2 3\n1e300 0 0\n", "a point is 1e+300 mm away, further than 100 m: give the points in mm"},
      {"metres.csv", "x [m],y [m],z [m]\n0,0,-101\n", "a point is 101000 mm away"},
      {"lacks.csv", "name,x,y\na,1,2\n", "x, y and z are not named there, each once"},
      {"twice.csv", "x,y,z,tx\n1,2,3,4\n", "each once"},
      {"units.csv", "x [mm],y [m],z [m]\n1,2,3\n", "are not all in mm"},
      {"furlongs.csv", "x [furlong],y [furlong],z [furlong]\n1,2,3\n", "are not all in mm"},
      {"hole.csv", "name,x,y,z\na,1,,3\n", "line 2: y is missing"},
      {"none.txt", "# nothing\n", "holds no points"},
      {"picture.txt", std::string("\x89PNG\r\n\x1a\n\0\0", 10), "is no text; save the points as"},
      {"frameless.fcsv", "# Markups fiducial file version = 4.11\n# columns = id,x,y,z\n1,2,3,4\n",
       "CoordinateSystem = LPS"},
      {"ijk.fcsv", "# CoordinateSystem = IJK\n1 2 3\n", "save the points in LPS or RAS"},
      {"both.fcsv", "# CoordinateSystem = LPS\n# CoordinateSystem = RAS\n1 2 3\n", "line 2: the CoordinateSystem"},
      {"both.csv", "# CoordinateSystem = LPS\nlabel,r,a,s\na,1,2,3\n", "say both LPS and RAS"},
      {"both.mrk.json", markups("RAS\", \"coordinateSystem\": \"LPS"), "\"coordinateSystem\" stands twice"},
      {"again.mrk.json", markups("LPS", "mm", "defined\", \"positionStatus\": \"defined"),
       "\"positionStatus\" stands twice"},
      {"metres.mrk.json", markups("LPS", "m"), "\"coordinateUnits\" is not mm"},
      {"ijk.mrk.json", markups("IJK"), "neither LPS nor RAS"},
      {"other.json", "{\"a\": 1}", "is no list of points as 3D Slicer saves it"},
      {"broken.json", "{\"a", "is no list of points as 3D Slicer saves it"},
      {"two.mrk.json", R"({"markups": [{}, {}]})", "holds 2 lists"},
      {"other.mps", "<xml/>", "is no point set as MITK saves it"}};
  for (const auto& [name, text, words] : files) {
    const auto read = read_named_points(scratch.file(name, text), PointsOf::patient);
    ASSERT_FALSE(read) << name;
    EXPECT_NE(read.error().what.find(words), std::string::npos) << read.error().what;
    EXPECT_NE(read.error().what.find(name), std::string::npos) << read.error().what;
  }
  EXPECT_FALSE(read_named_points(scratch / "no.mrk.json", PointsOf::patient));
}

TEST(NamedPoints, MitksPointSetsAreReadUnlessTheyHaveAGeometry) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const auto folder = *data / "fiducial_registration_pelvis_phantom";
  const auto set = read_points(folder / "pelvis_cropped_ct_fiducial_markers.mps", PointsOf::patient);
  const auto text = read_points(folder / "pelvis_cropped_ct_fiducial_markers.txt", PointsOf::patient);
  ASSERT_TRUE(set && text);
  EXPECT_EQ(*set, *text);

  const testing::Scratch scratch;
  std::string moved = testing::contents_of(folder / "pelvis_cropped_ct_fiducial_markers.mps");
  moved.replace(moved.find("Offset type=\"Vector3D\" x=\"0\""), 28, "Offset type=\"Vector3D\" x=\"9\"");
  const auto refused = read_points(scratch.file("moved.mps", moved), PointsOf::patient);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("geometry of their own"), std::string::npos) << refused.error().what;
}

}  // namespace
}  // namespace birdseye::host
