#include "host/files/body_points.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <random>

#include "calibration/geometry/rotations.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;
using Points = std::vector<Eigen::Vector3d>;

const Points kBody{{0, 0, 0}, {50, 0, 5}, {0, 80, 0}, {-30, 20, 25}};

std::string notes_of(const PoseSet& set) {
  std::string out;
  for (const std::string& note : set.notes) out += note + "\n";
  return out;
}

std::string body_text(const Points& points, const std::vector<std::string>& names = {}) {
  std::string out = names.empty() ? "x,y,z\n" : "name,x,y,z\n";
  for (std::size_t i = 0; i < points.size(); ++i)
    out +=
        fmt::format("{}{},{},{}\n", names.empty() ? "" : names[i] + ",", points[i].x(), points[i].y(), points[i].z());
  return out;
}

/// Where a body's points are tracked while it moves.
struct TrackedBody {
  std::mt19937 random{5};
  double noise_mm = 0.1;
  std::vector<Transform<Tracker, Sensor>> truth;

  std::string rows(int count, const Points& body = kBody, bool timed = false) {
    std::normal_distribution<double> normal;
    std::string out;
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d turn(normal(random), normal(random), normal(random));
      const Eigen::Vector3d place(100 * normal(random), 100 * normal(random), -1500 + 50 * normal(random));
      truth.emplace_back(rotation_exp(turn), place);
      if (timed) out += fmt::format("{},", 0.5 * i);
      for (std::size_t p = 0; p < body.size(); ++p) {
        const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
        const Eigen::Vector3d seen = truth.back() * body[p] + noise_mm * noise;
        out += fmt::format("{}{},{},{}", p == 0 ? "" : ",", seen.x(), seen.y(), seen.z());
      }
      out += "\n";
    }
    return out;
  }
};

Result<PoseSet> read_tracked(const std::string& body, const std::string& recording, PoseReading how = {}) {
  const Scratch scratch;
  how.body = scratch.file("body.csv", body);
  return read_pose_set(scratch.file("points.csv", recording), how);
}

TEST(BodyPoints, APoseForEachRowWithItsError) {
  TrackedBody tracked;
  for (const char* header :
       {"", "x1,y1,z1,x2,y2,z2,x3,y3,z3,x4,y4,z4\n", "1_x,1_y,1_z,2_x,2_y,2_z,3_x,3_y,3_z,4_x,4_y,4_z\n",
        "P1 X [mm],P1 Y [mm],P1 Z [mm],P2 X [mm],P2 Y [mm],P2 Z [mm],P3 X [mm],P3 Y [mm],P3 Z [mm],P4 X [mm],P4 Y [mm],"
        "P4 Z [mm]\n"}) {
    tracked.truth.clear();
    const auto set = read_tracked(body_text(kBody), std::string(header) + tracked.rows(20));
    ASSERT_TRUE(set) << set.error().what << header;
    ASSERT_EQ(set->poses.size(), 20U) << header;
    EXPECT_FALSE(set->timed);
    for (std::size_t i = 0; i < 20; ++i) {
      const auto& pose = set->poses[i];
      EXPECT_LT((pose.tracker_from_sensor.translation() - tracked.truth[i].translation()).norm(), 0.5);
      EXPECT_LT(rotation_angle_between(pose.tracker_from_sensor.rotation(), tracked.truth[i].rotation()), 0.01);
      ASSERT_TRUE(pose.error_mm);
      EXPECT_GT(*pose.error_mm, 0.01);
      EXPECT_LT(*pose.error_mm, 0.4);
    }
    EXPECT_NE(notes_of(*set).find("errors of its poses: median"), std::string::npos);
  }
}

TEST(BodyPoints, NamesPairPointsInWhateverOrder) {
  TrackedBody tracked;
  tracked.noise_mm = 0;
  const Points turned{kBody[2], kBody[0], kBody[3], kBody[1]};
  const std::string header = "t,C_x,C_y,C_z,A_x,A_y,A_z,D_x,D_y,D_z,B_x,B_y,B_z\n";
  const auto set = read_tracked(body_text(kBody, {"A", "B", "C", "D"}), header + tracked.rows(3, turned, true));
  ASSERT_TRUE(set) << set.error().what;
  EXPECT_TRUE(set->timed);
  EXPECT_EQ(set->poses[2].time_s, 1);
  EXPECT_LT((set->poses[2].tracker_from_sensor.matrix() - tracked.truth[2].matrix()).norm(), 1e-2);
  const auto lacking = read_tracked(body_text(kBody, {"A", "B", "C", "E"}), header + tracked.rows(3, turned, true));
  ASSERT_FALSE(lacking);
  EXPECT_NE(lacking.error().what.find("only 3 of the body's 4 points"), std::string::npos) << lacking.error().what;
}

TEST(BodyPoints, RowsWithFewPointsOrALargeErrorAreAbsentAndCounted) {
  const std::string one_lost = "1,1,1,51,1,6,1,81,1,,,\n", two_lost = "1,1,1,51,1,6,nan,nan,nan,0,0,0\n";
  const std::string ghost = "1,1,1,51,1,6,1,81,1,90,90,90\n", whole = "1,1,1,51,1,6,1,81,1,-29,21,26\n";
  const auto set = read_tracked(body_text(kBody), whole + one_lost + two_lost + whole + ghost + ",,,,,,,,,,,\n");
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 3U);
  EXPECT_EQ(set->poses[2].index, 3U);
  EXPECT_LT((set->poses[1].tracker_from_sensor.translation() - Eigen::Vector3d(1, 1, 1)).norm(), 1e-9);
  ASSERT_EQ(set->rejected.size(), 3U);
  EXPECT_EQ(set->rejected[0], "line 3: 2 of 4 points were seen; a pose needs three");
  EXPECT_NE(set->rejected[1].find("line 5: its error of"), std::string::npos);
  EXPECT_EQ(set->rejected[2], "line 6: missing");
  EXPECT_NE(notes_of(*set).find("2 of 6 rows show fewer than three points"), std::string::npos) << notes_of(*set);
  EXPECT_NE(notes_of(*set).find("1 of 4 are over 2 mm"), std::string::npos) << notes_of(*set);
}

TEST(BodyPoints, ABodyInAnotherOrderMirroredOrInAnotherUnitIsNamed) {
  TrackedBody tracked;
  const Points mirrored{{0, 0, 0}, {-50, 0, 5}, {0, 80, 0}, {30, 20, 25}};
  Points metres;
  for (const Eigen::Vector3d& p : kBody) metres.push_back(p / 1000);
  for (const auto& [body, words] :
       {std::pair{body_text({kBody[1], kBody[0], kBody[2], kBody[3]}), "they fit in the order 2,1,3,4"},
        {body_text({kBody[3], kBody[0], kBody[1], kBody[2]}, {"d", "a", "b", "c"}), "they fit in the order a,b,c,d"},
        {body_text(mirrored), "the body is mirrored"},
        {body_text({mirrored[1], mirrored[0], mirrored[2], mirrored[3]}), "in the order 2,1,3,4, mirrored"},
        {body_text(metres), "times as far apart as the body's: give both in one unit"}}) {
    const auto set = read_tracked(body, tracked.rows(10));
    ASSERT_FALSE(set) << words;
    EXPECT_NE(set.error().what.find(words), std::string::npos) << set.error().what;
  }
  // Nothing of that: a body of another shape.
  const auto other = read_tracked(body_text({{0, 0, 0}, {20, 0, 0}, {0, 70, 0}, {90, 0, 60}}), tracked.rows(10));
  ASSERT_FALSE(other);
  EXPECT_NE(other.error().what.find("none of 10 poses can be used; line 1: its error of"), std::string::npos)
      << other.error().what;
}

/// Rows of a body, each number divided.
std::string divided(const std::string& rows, double by) {
  std::string out;
  for (std::size_t at = 0; at < rows.size();) {
    const std::size_t end = rows.find_first_of(",\n", at);
    out += fmt::format("{}{}", std::stod(rows.substr(at, end - at)) / by, rows[end]);
    at = end + 1;
  }
  return out;
}

std::string divided_body(double by) {
  Points out;
  for (const Eigen::Vector3d& p : kBody) out.push_back(p / by);
  return body_text(out);
}

TEST(BodyPoints, ABodyInAnotherUnitThanItsRecordingIsNamedWithBothUnits) {
  TrackedBody tracked;
  tracked.noise_mm = 0;
  const std::string rows = tracked.rows(10);
  for (const auto& [body_by, rows_by, words] :
       {std::tuple{1000., 1., "1000 times as far apart as the body's: give both in one unit (metres and mm?)"},
        {1., 25.4, "1/25.4 as far apart as the body's: give both in one unit (inches and mm?)"},
        {10., 1., "10 times as far apart as the body's: give both in one unit (cm and mm?)"},
        {1.3, 1., "1.3 times as far apart as the body's: measure the body's points anew"}}) {
    const auto set = read_tracked(divided_body(body_by), divided(rows, rows_by));
    ASSERT_FALSE(set) << words;
    EXPECT_NE(set.error().what.find(words), std::string::npos) << set.error().what;
  }
}

TEST(BodyPoints, ABodyThatIsTooSmallOrTooLargeIsRefusedWithTheUnitsItMayHave) {
  TrackedBody tracked;
  const std::string rows = tracked.rows(10);
  for (const auto& [by, how, words] :
       {std::tuple{1000., PoseReading{}, "are in metres, say so: --unit m"},
        {25.4, PoseReading{}, "are in cm or inches, say so: --unit cm or --unit in"},
        {1., PoseReading{.mm_per_unit = 1000, .unit_said = true}, "are in mm or cm, say so: --unit mm or --unit cm"}}) {
    const auto set = read_tracked(divided_body(by), divided(rows, by), how);
    ASSERT_FALSE(set) << words;
    EXPECT_NE(set.error().what.find("body.csv: its points are at most"), std::string::npos) << set.error().what;
    EXPECT_NE(set.error().what.find(words), std::string::npos) << set.error().what;
  }
  const PoseReading small{.unit_said = true};
  EXPECT_TRUE(read_tracked(divided_body(25.4), divided(rows, 25.4), small)) << "somebody said that it is so small";
}

TEST(BodyPoints, RefusalsNameTheFileAndTheRemedy) {
  TrackedBody tracked;
  const std::string rows = tracked.rows(3);
  for (const auto& [body, recording, words] :
       {std::tuple{std::string("1,2,3\n4,5,6\n"), rows, "body.csv: has 2 points"},
        {std::string("1,2,3\n4,5\n"), rows, "body.csv: line 2: is no point but 2 numbers or words; give x,y,z a line"},
        {std::string("0,0,0,50,0,5,0,80,0\n"), rows,
         "body.csv: line 1: is no point but 9 numbers or words; give x,y,z"},
        {std::string("{\"points\": [[0, 0, 0], [50, 0, 5]]}\n"), rows, "body.csv: has 0 points"},
        {std::string("a,1,2,3\na,4,5,6\nb,7,8,10\n"), rows, "two of its points are called a"},
        {std::string("a,1,2,3\n4,5,6\nb,7,8,10\n"), rows, "some of its points have names"},
        {body_text(kBody), std::string("1,2,3,4\n"), "4 columns where 4 points of the body have 12, or 13"},
        {body_text(kBody), std::string("x1,y1,z1,x2,y2,z2\n"), "columns of 2 numbered points where the body has 4"},
        {body_text(kBody), std::string("x1,y1,z1,x2,y2,z2,x3,y3,z3,x4,y4\n"), "lacks a coordinate of point 4"},
        {body_text(kBody), std::string("Format Version,1.23,Take Name,a\n"), "is an export of OptiTrack Motive"},
        {body_text(kBody), std::string(), "holds no points"}}) {
    const auto set = read_tracked(body, recording);
    ASSERT_FALSE(set) << words;
    EXPECT_NE(set.error().what.find(words), std::string::npos) << set.error().what;
  }
}

}  // namespace
}  // namespace birdseye::host
