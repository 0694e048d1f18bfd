// Tables of poses as other programs write them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "calibration/field/field_fit.hpp"
#include "host/files/column_names.hpp"
#include "host/files/field_files.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/pose_files.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/simulated_field.hpp"

namespace birdseye::host {
namespace {

using testing::Scratch;

std::string joined(const std::vector<std::string>& texts) {
  std::string out;
  for (const std::string& text : texts) out += text + "\n";
  return out;
}

Result<PoseSet> read(const std::string& text, const PoseReading& how = {}, const std::string& name = "p.csv") {
  const Scratch scratch;
  return read_pose_set(scratch.file(name, text), how);
}

/// Two poses: a quarter turn about z at 1, 2, 3, then none at 4, 5, 6.
void expect_the_two(const Result<PoseSet>& set, const std::string& text) {
  ASSERT_TRUE(set) << set.error().what << "\n" << text;
  ASSERT_EQ(set->poses.size(), 2U) << text << joined(set->rejected);
  const auto& poses = set->poses;
  EXPECT_LT((poses[0].tracker_from_sensor * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm(), 1e-5) << text;
  EXPECT_LT((poses[1].tracker_from_sensor * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(5, 5, 6)).norm(), 1e-5) << text;
  EXPECT_EQ(poses[1].index, 1U) << text;
}

TEST(PoseTables, PosesWithoutTimesCountByTheirOrder) {
  for (const std::string& text :
       {std::string("x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0.7071068,0.7071068\n4,5,6,0,0,0,1\n"),
        std::string("1,2,3,0,0,0.7071068,0.7071068\n4,5,6,0,0,0,1\n"),
        std::string("tx;ty;tz;q0;qx;qy;qz;note\n1;2;3;0,7071068;0;0;0,7071068;\n4;5;6;1;0;0;0;\n"),
        std::string("0,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1\n1 0 0 4 0 1 0 5 0 0 1 6 0 0 0 1\n"),
        std::string("0 -1 0 1 1 0 0 2 0 0 1 3\n1 0 0 4 0 1 0 5 0 0 1 6\n")}) {
    const auto set = read(text);
    expect_the_two(set, text);
    EXPECT_FALSE(set->timed);
    EXPECT_NE(joined(set->notes).find("no times: its poses count by their order"), std::string::npos);
  }
}

TEST(PoseTables, AMatrixMayFollowItsTime) {
  for (const char* text : {"1.5,0,-1,0,1,1,0,0,2,0,0,1,3,0,0,0,1\n2.5 1 0 0 4 0 1 0 5 0 0 1 6 0 0 0 1\n",
                           "1.5 0 -1 0 1 1 0 0 2 0 0 1 3\n2.5 1 0 0 4 0 1 0 5 0 0 1 6\n"}) {
    const auto set = read(text);
    expect_the_two(set, text);
    EXPECT_TRUE(set->timed);
    EXPECT_EQ(set->poses[0].time_s, 1.5);
  }
}

TEST(PoseTables, MatricesByColumnsAreReadOrRefusedWithTheRemedy) {
  const std::vector<std::string> by_columns{"0,1,0,0,-1,0,0,0,0,0,1,0,1,2,3,1\n1 0 0 0 0 1 0 0 0 0 1 0 4 5 6 1\n",
                                            "0 1 0 -1 0 0 0 0 1 1 2 3\n1 0 0 0 1 0 0 0 1 4 5 6\n",
                                            "7 0 1 0 0 -1 0 0 0 0 0 1 0 1 2 3 1\n8 1 0 0 0 0 1 0 0 0 0 1 0 4 5 6 1\n"};
  PoseReading how;
  how.column_major = true;
  for (const std::string& text : by_columns) {
    expect_the_two(read(text, how), text);
    const auto unsaid = read(text);
    ASSERT_FALSE(unsaid) << text;
    EXPECT_NE(unsaid.error().what.find("it is written column by column: say --column-major"), std::string::npos)
        << unsaid.error().what;
  }
  const auto by_rows = read("0 -1 0 1 1 0 0 2 0 0 1 3 0 0 0 1\n1 0 0 4 0 1 0 5 0 0 1 6 0 0 0 1\n", how);
  ASSERT_FALSE(by_rows);
  EXPECT_NE(by_rows.error().what.find("written row by row: leave --column-major out"), std::string::npos);
  const auto quaternions = read("1,2,3,0,0,0,1\n", how);
  ASSERT_FALSE(quaternions);
  EXPECT_NE(quaternions.error().what.find("--column-major goes with matrices"), std::string::npos);
  const Scratch scratch;
  std::filesystem::create_directory(scratch / "poses");
  (void)scratch.file("poses/1.txt", "0 1 0 0\n-1 0 0 0\n0 0 1 0\n1 2 3 1\n");
  (void)scratch.file("poses/2.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n4 5 6 1\n");
  expect_the_two(read_pose_set(scratch / "poses", how), "a folder");
}

TEST(PoseTables, AnglesAreRefusedByTheirNames) {
  for (const auto& [header, angles] : std::vector<std::pair<std::string, std::string>>{
           {"t,x,y,z,yaw,pitch,roll\n", "(yaw, pitch, roll)"},
           {"x;y;z;Azimuth (deg);Elevation (deg);Roll (deg)\n", "(Azimuth (deg), Elevation (deg), Roll (deg))"},
           {"# time tx ty tz rx ry rz\n", "(rx, ry, rz)"},
           {"t,x,y,z,rot_x,rot_y,rot_z\n", "(rot_x, rot_y, rot_z)"}}) {
    const auto set = read(header + "0,1,2,3,0.1,0.2,0.3\n");
    ASSERT_FALSE(set) << header;
    EXPECT_NE(set.error().what.find(angles), std::string::npos) << set.error().what;
    EXPECT_NE(set.error().what.find("export quaternions"), std::string::npos) << set.error().what;
  }
  EXPECT_TRUE(read("x,y,z,qx,qy,qz,qw,yaw,pitch,roll\n1,2,3,0,0,0,1,0,0,0\n")) << "beside a quaternion they do no harm";
  EXPECT_TRUE(read("# no roll, pitch alone\n1,2,3,0,0,0,1\n")) << "words of a remark";
}

TEST(PoseTables, HeadersOfOtherPrograms) {
  const std::vector<std::tuple<std::string, double, double>> tables{
      {"# timestamp tx ty tz qx qy qz qw\n0.5 1 2 3 0 0 0.7071068 0.7071068\n1.5 4 5 6 0 0 0 1\n", 0.5, 1},
      {"#timestamp [ns],p_RS_R_x [m],p_RS_R_y [m],p_RS_R_z [m],q_RS_w [],q_RS_x [],q_RS_y [],q_RS_z []\n"
       "500000000,0.001,0.002,0.003,0.7071068,0,0,0.7071068\n1500000000,0.004,0.005,0.006,1,0,0,0\n",
       0.5, 1},
      {"%time,field.header.seq,field.pose.position.x,field.pose.position.y,field.pose.position.z,"
       "field.pose.orientation.x,field.pose.orientation.y,field.pose.orientation.z,field.pose.orientation.w\n"
       "1500000000500000000,1,1,2,3,0,0,0.7071068,0.7071068\n1500000001500000000,2,4,5,6,0,0,0,1\n",
       1500000000.5, 1},
      {"Time (ms)\tX (cm)\tY (cm)\tZ (cm)\tQx\tQy\tQz\tQw\t\r\n500\t0,1\t0,2\t0,3\t0\t0\t0,7071068\t0,7071068\t\r\n"
       "1500\t0,4\t0,5\t0,6\t0\t0\t0\t1\t\r\n",
       0.5, 1},
      {"t,x,y,z,qx,qy,qz,qw\n0.5,1,2,3,0,0,0.7071068,0.7071068\nt,x,y,z,qx,qy,qz,qw\n1.5,4,5,6,0,0,0,1\n", 0.5, 1}};
  for (const auto& [text, first_s, apart_s] : tables) {
    const auto set = read(text);
    expect_the_two(set, text);
    EXPECT_TRUE(set->timed);
    EXPECT_NEAR(set->poses[0].time_s, first_s, 1e-6) << text;
    EXPECT_NEAR(set->poses[1].time_s - set->poses[0].time_s, apart_s, 1e-6) << text;
  }
  EXPECT_NE(joined(read(std::get<0>(tables[3]))->notes).find("decimal commas"), std::string::npos);
  EXPECT_NE(joined(read(std::get<0>(tables[4]))->notes).find("header comes again in 1 later line, passed over"),
            std::string::npos);
}

TEST(PoseTables, AUnitOfLengthThatIsNotReadIsRefusedByName) {
  const std::string row = "0,1,2,3,0,0,0,1\n";
  for (const auto& [header, said] : std::vector<std::pair<std::string, std::string>>{
           {"t,x [furlong],y [furlong],z [furlong],qx,qy,qz,qw\n", "'furlong'"},
           {"t,x [m],y [mm],z [mm],qx,qy,qz,qw\n", "m, mm, mm"},
           {"t,x [m],y,z,qx,qy,qz,qw\n", "m alone"}}) {
    const auto set = read(header + row);
    ASSERT_FALSE(set) << header;
    EXPECT_NE(set.error().what.find(said), std::string::npos) << set.error().what;
  }
  const auto inches = read("t,x (in),y (in),z (in),qx,qy,qz,qw\n" + row);
  ASSERT_TRUE(inches) << inches.error().what;
  EXPECT_NEAR(inches->poses.front().tracker_from_sensor.translation().x(), 25.4, 1e-9);
}

TEST(PoseTables, AHeaderWithTwoPosesIsRefused) {
  const auto set = read("t,x,y,z,qx,qy,qz,qw\n");
  ASSERT_FALSE(set);
  const auto two = read("t,a_tx,a_ty,a_tz,qx,qy,qz,qw,b_tx,b_ty,b_tz\n0,1,2,3,0,0,0,1,4,5,6\n");
  ASSERT_FALSE(two);
  EXPECT_NE(two.error().what.find("both a_tx and b_tx for x"), std::string::npos) << two.error().what;
  EXPECT_TRUE(read("t,x,y,z,qx,qy,qz,qw,tx\n0,1,2,3,0,0,0,1,4\n"));  // our own name goes before
}

TEST(PoseTables, NamesOfColumns) {
  for (const auto& [text, column] : {std::pair{"t", PoseColumn::time},
                                     {"Timestamp_s", PoseColumn::time},
                                     {"x_mm", PoseColumn::x},
                                     {"position.z", PoseColumn::z},
                                     {"Q0", PoseColumn::qw},
                                     {"q1", PoseColumn::qx},
                                     {"q3", PoseColumn::qz},
                                     {"orientation.w", PoseColumn::qw},
                                     {" Qx ", PoseColumn::qx},
                                     {"T_y [m]", PoseColumn::y},
                                     {"rotation_x", PoseColumn::qx}})
    EXPECT_EQ(pose_column(column_name(text)), column) << text;
  for (const char* text : {"", "frame", "marker1 x", "error", "w", "velocity_x", "[m]", "qualisys"})
    EXPECT_FALSE(pose_column(column_name(text))) << text;
  EXPECT_EQ(column_name("x [m]").unit, "m");
  EXPECT_EQ(column_name("t_ns").unit, "ns");
}

/// Two tools, row after row, under a header with the column that names them.
std::string of_two_tools(const std::string& column, const std::vector<std::string>& names) {
  std::string text = fmt::format("t,{},x,y,z,qx,qy,qz,qw\n", column);
  for (int n = 0; n < 6; ++n) {
    const auto tool = static_cast<std::size_t>(n % 2);
    text += fmt::format("{},{},{},{},3,0,0,0,1\n", 0.1 * (n / 2), names[tool], 10 * n, tool);
  }
  return text;
}

TEST(PoseTables, OfSeveralToolsOneMustBeNamed) {
  for (const char* column : {"tool", "Tool Name", "rigid_body", "sensor_id", "port", "marker_id", "id", "name"}) {
    const std::string text = of_two_tools(column, {"8700339", "Scope"});
    const auto mixed = read(text);
    ASSERT_FALSE(mixed) << column;
    for (const char* words : {"p.csv", "--tool NAME", "8700339 (3 rows), Scope (3 rows)", column})
      EXPECT_NE(mixed.error().what.find(words), std::string::npos) << mixed.error().what;
    const auto one = read(text, {.transform = "scope"});
    ASSERT_TRUE(one) << one.error().what;
    ASSERT_EQ(one->poses.size(), 3U) << joined(one->rejected);
    EXPECT_EQ(one->poses[1].tracker_from_sensor.translation(), Eigen::Vector3d(30, 1, 3));
    EXPECT_EQ(one->poses[1].index, 1U);
    EXPECT_TRUE(one->rejected.empty()) << joined(one->rejected);
    EXPECT_NE(joined(one->notes).find("the poses of Scope are read; 3 other rows"), std::string::npos);
    const auto none = read(text, {.transform = "Pointer", .option_prefix = "board-"});
    ASSERT_FALSE(none);
    EXPECT_NE(none.error().what.find("has no tool Pointer"), std::string::npos) << none.error().what;
  }
  const auto said = read(of_two_tools("tool", {"A", "B"}), {.option_prefix = "board-"});
  ASSERT_FALSE(said);
  EXPECT_NE(said.error().what.find("--board-tool NAME"), std::string::npos) << said.error().what;
}

TEST(PoseTables, ANameThatCannotApplyIsRefused) {
  const auto table = read("t,x,y,z,qx,qy,qz,qw\n0,1,2,3,0,0,0,1\n", {.transform = "Scope"});
  ASSERT_FALSE(table);
  EXPECT_NE(table.error().what.find("--tool Scope"), std::string::npos) << table.error().what;
  const Scratch scratch;
  (void)scratch.file("a.txt", "1 0 0 1 0 1 0 2 0 0 1 3 0 0 0 1\n");
  const auto folder = read_pose_set(scratch.path(), {.transform = "Scope"});
  ASSERT_FALSE(folder);
  EXPECT_NE(folder.error().what.find("--tool Scope"), std::string::npos) << folder.error().what;
  // Names of rows, one of each, are no tools.
  const std::string named = "name,x,y,z,qx,qy,qz,qw\nview1.png,1,2,3,0,0,0,1\nview2.png,4,5,6,0,0,0,1\n";
  EXPECT_EQ(read(named)->poses.size(), 2U);
  EXPECT_FALSE(read(named, {.transform = "view1.png"}));
  // One tool alone need not be named.
  const auto only = read("tool,x,y,z,qx,qy,qz,qw\nScope,1,2,3,0,0,0,1\nScope,4,5,6,0,0,0,1\n");
  ASSERT_TRUE(only) << only.error().what;
  EXPECT_EQ(only->poses.size(), 2U);
}

TEST(PoseTables, TimesTooLargeForSecondsAreCountedInSmallerUnits) {
  for (const double per_s : {1.0, 1e3, 1e6, 1e9}) {
    const auto set =
        read(fmt::format("{:.0f},1,2,3,0,0,0,1\n{:.0f},4,5,6,0,0,0,1\n", 1.5e9 * per_s, 1.5e9 * per_s + 2 * per_s));
    ASSERT_TRUE(set) << set.error().what;
    EXPECT_NEAR(set->poses[1].time_s - set->poses[0].time_s, 2, 1e-5) << per_s;
  }
}

TEST(PoseTables, TimesOfNoTrackersRateNeedAUnit) {
  std::string text;
  for (int n = 0; n < 30; ++n) text += fmt::format("{},{},2,3,0,0,0,1\n", 25'000 * n, n);  // microseconds
  const auto refused = read(text);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().what.find("--time-unit"), std::string::npos) << refused.error().what;
  const auto told = read(text, {.s_per_unit = 1e-6});
  ASSERT_TRUE(told) << told.error().what;
  EXPECT_NEAR(told->poses.back().time_s, 29 * 0.025, 1e-9);
  EXPECT_TRUE(read("t [us],x,y,z,qx,qy,qz,qw\n" + text));
}

TEST(PoseTables, RowsThatShareTheirTimesAreTold) {
  std::string text;
  for (int n = 0; n < 40; ++n) text += fmt::format("{},{},2,3,0,0,0,1\n", n / 2, n);
  const auto set = read(text);
  ASSERT_TRUE(set) << set.error().what;
  EXPECT_NE(joined(set->notes).find("20 of 40 rows have the time of another row: has the file poses of several tools"),
            std::string::npos)
      << joined(set->notes);
  EXPECT_EQ(by_kind(set->rejected).size(), 1U);
  EXPECT_NE(by_kind(set->rejected).front().find("(and 19 more like it)"), std::string::npos);
}

TEST(PoseTables, PosesTheOtherWayRoundAreInverted) {
  const auto set = read("1,2,3,0,0,0.7071068,0.7071068\n", {.inverted = true});
  ASSERT_TRUE(set) << set.error().what;
  EXPECT_LT((set->poses[0].tracker_from_sensor * Eigen::Vector3d(1, 2, 3)).norm(), 1e-5);
}

TEST(PoseTables, AFolderOfTablesOfOneRowEachIsRead) {
  const Scratch scratch;
  for (const int n : {10, 9})
    (void)scratch.file(fmt::format("pose_{}.csv", n), fmt::format("x,y,z,qx,qy,qz,qw\n{},2,3,0,0,0,1\n", n));
  (void)scratch.file("pose_11.csv", "1,0,0,11\n0,1,0,2\n0,0,1,3\n0,0,0,1\n");
  const auto set = read_pose_set(scratch.path());
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 3U) << joined(set->rejected);
  for (const int n : {0, 1, 2}) {
    const auto at = static_cast<std::size_t>(n);
    EXPECT_EQ(set->poses[at].tracker_from_sensor.translation().x(), 9 + n);
  }
  (void)scratch.file("pose_12.csv", "1,2,3,0,0,0,1\n4,5,6,0,0,0,1\n");
  EXPECT_EQ(joined(read_pose_set(scratch.path())->rejected),
            "pose_12.csv: 2 rows where each file of a folder holds one pose\n");
}

const std::string kNdiHeader =
    "Tools\tPort 1\tFrame\tFace\tState\tQ0\tQx\tQy\tQz\tTx\tTy\tTz\tError\tMarkers\tState\tTx\tTy\tTz\t"
    "Port 2\tFrame\tFace\tState\tQ0\tQx\tQy\tQz\tTx\tTy\tTz\tError\r\n";
const std::string kTurn1 = "0.7071068\t0\t0\t0.7071068\t1\t2\t3\t";
const std::string kNone1 = "1\t0\t0\t0\t4\t5\t6\t";

/// Two tools side by side over four frames; the first is lost in one and disabled in another.
std::string ndi_log() {
  const std::string second = "\t8700340\t%\t0\tOK\t1\t0\t0\t0\t7\t8\t9\t0.05\t\r\n";
  return "Date:=25:11:2026,10:00:00\r\n" + kNdiHeader +  //
         "2\t8700339\t100\t0\tOK\t" + kTurn1 + "0.1\t1\tOK\t1\t1\t1" + second +
         "2\t8700339\t101\t\tMissing\t\t\t\t\t\t\t\t\t0\t\t\t\t" + second + "2\t8700339\t102\t0\tDisabled\t" + kTurn1 +
         "0.1\t1\tMissing\t\t\t" + second + kNdiHeader +  //
         "2\t8700339\t103\t0\tOK\t" + kNone1 + "0.9\t1\tOK\t1\t1\t1" + second;
}

TEST(NdiLogs, AToolIsFoundByPortOrNameAndWhatIsLostIsAbsentAndCounted) {
  for (const char* tool : {"Port 1", "8700339", "port 1", "1"}) {
    const auto set = read(ndi_log(), {.transform = tool}, "log.tsv");
    ASSERT_TRUE(set) << set.error().what;
    ASSERT_EQ(set->poses.size(), 2U) << joined(set->rejected);
    EXPECT_FALSE(set->timed);
    EXPECT_EQ(set->poses[1].index, 3U);
    EXPECT_EQ(set->poses[0].error_mm, 0.1);
    EXPECT_LT((set->poses[0].tracker_from_sensor * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm(), 1e-5);
    EXPECT_EQ(joined(set->rejected), "line 4: Missing\nline 5: Disabled\n");
    EXPECT_NE(joined(set->notes).find("Port 1 (8700339): 4 records, 1 Disabled, 1 Missing, 2 OK"), std::string::npos)
        << joined(set->notes);
  }
  const auto other = read(ndi_log(), {.transform = "8700340"});
  ASSERT_TRUE(other) << other.error().what;
  ASSERT_EQ(other->poses.size(), 4U);
  EXPECT_EQ(other->poses[3].tracker_from_sensor.translation(), Eigen::Vector3d(7, 8, 9));
}

TEST(NdiLogs, AToolAgainstAnother) {
  const auto set = read(ndi_log(), {.transform = "Port 1", .reference = "Port 2"});
  ASSERT_TRUE(set) << set.error().what;
  ASSERT_EQ(set->poses.size(), 2U);
  EXPECT_EQ(set->poses[1].tracker_from_sensor.translation(), Eigen::Vector3d(-3, -3, -3));
  EXPECT_EQ(set->rejected[0], "line 4: Port 1 (8700339) Missing");
  EXPECT_FALSE(read(ndi_log(), {.transform = "Port 1", .reference = "8700339"}));
}

TEST(NdiLogs, AnErrorIsABound) {
  const auto set = read(ndi_log(), {.transform = "Port 1", .most_error_mm = 0.5});
  ASSERT_TRUE(set) << set.error().what;
  EXPECT_EQ(set->poses.size(), 1U);
  EXPECT_NE(joined(set->rejected).find("line 7: its error of 0.9 mm is over 0.5 mm"), std::string::npos);
  EXPECT_NE(joined(set->notes).find("1 of 2 are over 0.5 mm"), std::string::npos) << joined(set->notes);
  const auto none = read("0,1,2,3,0,0,0,1\n", {.most_error_mm = 0.5});
  ASSERT_FALSE(none);
  EXPECT_NE(none.error().what.find("leave --max-error out"), std::string::npos);
}

TEST(NdiLogs, RowsOfOneToolEachAndMoreMarkersThanTheHeaderHas) {
  const std::string text =
      "#Tools,ToolInfo,Frame#,PortHandle,Face#,TransformStatus,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers,State,Tx,Ty,Tz\n"
      "1,ROM-A s/n:1,7,Port:1,0,OK,1,0,0,0,1,2,3,0.1,2,OK,1,1,1,OK,2,2,2\n"
      "1,ROM-B s/n:2,7,Port:2,0,OK,1,0,0,0,4,5,6,0.1,0\n"
      "1,ROM-A s/n:1,8,Port:1,0,Missing,,,,,,,,,0\n";
  const auto a = read(text, {.transform = "Port 1"});
  ASSERT_TRUE(a) << a.error().what;
  EXPECT_EQ(a->poses.size(), 1U);
  EXPECT_EQ(a->rejected.size(), 1U);
  const auto b = read(text, {.transform = "ROM-B s/n:2"});
  ASSERT_TRUE(b) << b.error().what;
  EXPECT_EQ(b->poses[0].tracker_from_sensor.translation(), Eigen::Vector3d(4, 5, 6));
  // Both in one row: the second begins after the two markers of the first.
  const auto both = read(
      "#Tools,ToolInfo,Frame#,PortHandle,Face#,TransformStatus,Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error,Markers,State,Tx,Ty,Tz\n"
      "2,A,7,Port:1,0,OK,1,0,0,0,1,2,3,0.1,2,OK,1,1,1,OK,2,2,2,B,7,Port:2,0,OK,1,0,0,0,4,5,6,0.1,0\n",
      {.transform = "B"});
  ASSERT_TRUE(both) << both.error().what;
  EXPECT_EQ(both->poses[0].tracker_from_sensor.translation(), Eigen::Vector3d(4, 5, 6));
}

TEST(NdiLogs, UnitsInTheHeaderAndDecimalCommas) {
  const auto set = read(
      "Tool;Frame;State;Q0;Qx;Qy;Qz;Tx [mm];Ty [mm];Tz [mm];RMS Error (mm)\n"
      "probe;1;OK;1,0;0,0;0,0;0,0;1,5;-2,5;3;0,12\n");
  ASSERT_TRUE(set) << set.error().what;
  EXPECT_EQ(set->poses[0].tracker_from_sensor.translation(), Eigen::Vector3d(1.5, -2.5, 3));
  EXPECT_EQ(set->poses[0].error_mm, 0.12);
  EXPECT_NE(joined(set->notes).find("decimal commas"), std::string::npos);
}

TEST(NdiLogs, RefusalsNameTheTools) {
  for (const auto& [text, tool, words] :
       {std::tuple{ndi_log(), "", "(--tool); it holds Port 1 (8700339), Port 2 (8700340)"},
        {ndi_log(), "Port 3", "has no tool Port 3; it holds Port 1"},
        {kNdiHeader, "", "holds no poses"},
        {std::string("Tools,Port 1,State,Q0,Qx,Qy\n1,a,OK,1,0,0\n"), "", "the columns of its tool 1 are not"}}) {
    const auto set = read(text, {.transform = tool});
    ASSERT_FALSE(set) << text;
    EXPECT_NE(set.error().what.find(words), std::string::npos) << set.error().what;
  }
}

class MappedField : public ::testing::Test {
 protected:
  const hw_sim::FieldDistortion field{10, 6};
  const calibration::FieldMap map = calibration::fit_field(testing::grid_samples(field, {}, 6))->map;

  /// What the tracker says of a sensor that truly is there.
  [[nodiscard]] std::string row(const Eigen::Vector3d& place) const {
    const hw_sim::BirdPose bent = field.apply({Eigen::Matrix3d::Identity(), place});
    const Eigen::Quaterniond q(bent.rotation);
    const Eigen::Vector3d& p = bent.position_mm;
    return fmt::format("{},{},{},{},{},{},{}\n", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
  }
};

TEST_F(MappedField, PosesAreCorrectedAsTheApplianceDoesAndNothingIsExtrapolated) {
  const std::string text = row({300, 20, 30}) + row({500, -100, -90}) + "900,0,0,0,0,0,1\n";
  const auto raw = read(text), corrected = read(text, {.field = map});
  ASSERT_TRUE(corrected) << corrected.error().what;
  ASSERT_EQ(corrected->poses.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    const auto by_map = map.correct(raw->poses[i].tracker_from_sensor);
    ASSERT_TRUE(by_map);
    EXPECT_EQ(corrected->poses[i].tracker_from_sensor.matrix(), by_map->tracker_from_sensor.matrix());
    EXPECT_NE(corrected->poses[i].tracker_from_sensor.rotation(), raw->poses[i].tracker_from_sensor.rotation());
  }
  // A rigid move of all is not the map's to know: what it has to restore is the distance.
  const auto apart = [](const PoseSet& set) {
    return (set.poses[0].tracker_from_sensor.translation() - set.poses[1].tracker_from_sensor.translation()).norm();
  };
  const double truth = Eigen::Vector3d(200, -120, -120).norm();
  EXPECT_LT(std::abs(apart(*corrected) - truth), 1);
  EXPECT_GT(std::abs(apart(*raw) - truth), 2 * std::abs(apart(*corrected) - truth));
  ASSERT_EQ(corrected->rejected.size(), 1U);
  EXPECT_NE(corrected->rejected[0].find("outside the mapped field"), std::string::npos);
  EXPECT_NE(joined(corrected->notes).find("1 of 3 poses lie where the field was not mapped"), std::string::npos);
}

TEST_F(MappedField, BothPosesOfAPairAreCorrectedBeforeOneIsTakenAgainstTheOther) {
  const auto matrix = [&](const Eigen::Vector3d& place) {
    const hw_sim::BirdPose bent = field.apply({Eigen::Matrix3d::Identity(), place});
    const Transform<Tracker, Sensor> pose(bent.rotation, bent.position_mm);
    std::string text;
    for (int i = 0; i < 16; ++i) text += fmt::format("{} ", pose.matrix()(i / 4, i % 4));
    return std::pair(text, *map.correct(pose));
  };
  const auto [a, corrected_a] = matrix({300, 20, 30});
  const auto [b, corrected_b] = matrix({350, 40, 0});
  const auto set = read("ObjectType = Image\nNDims = 3\nSeq_Frame0000_AToTrackerTransform = " + a +
                            "\nSeq_Frame0000_BToTrackerTransform = " + b + "\nElementDataFile = LOCAL\n",
                        {.transform = "AToTracker", .reference = "BToTracker", .field = map}, "s.mha");
  ASSERT_TRUE(set) << set.error().what;
  const Eigen::Matrix4d expected =
      corrected_b.tracker_from_sensor.matrix().inverse() * corrected_a.tracker_from_sensor.matrix();
  EXPECT_LT((set->poses[0].tracker_from_sensor.matrix() - expected).norm(), 1e-4);
}

TEST_F(MappedField, EachPointOfABodyIsCorrectedBeforeTheFit) {
  const std::vector<Eigen::Vector3d> body{{0, 0, 0}, {120, 0, 0}, {0, 110, 10}, {60, 50, 90}};
  std::string points, body_file;
  const Eigen::Vector3d at(300, -30, -20);
  for (const Eigen::Vector3d& p : body) {
    const Eigen::Vector3d seen = field.apply({Eigen::Matrix3d::Identity(), Eigen::Vector3d(at + p)}).position_mm;
    points += fmt::format("{}{},{},{}", points.empty() ? "" : ",", seen.x(), seen.y(), seen.z());
    body_file += fmt::format("{},{},{}\n", p.x(), p.y(), p.z());
  }
  const Scratch scratch;
  PoseReading how{.most_error_mm = 50, .body = scratch.file("body.csv", body_file)};
  const std::string lost = "900,0,0,1020,0,0,900,110,10,300,0,0\n";
  const auto raw = read(points + "\n", how);
  how.field = map;
  const auto corrected = read(points + "\n" + lost, how);
  ASSERT_TRUE(raw && corrected) << corrected.error().what;
  EXPECT_LT(*corrected->poses.at(0).error_mm, 0.5 * *raw->poses.at(0).error_mm);
  EXPECT_EQ(corrected->poses.size(), 1U);
  EXPECT_NE(joined(corrected->notes).find("3 of 8 points lie where the field was not mapped"), std::string::npos)
      << joined(corrected->notes);
}

TEST_F(MappedField, PlacesAreCorrectedAndThoseBeyondAreNamed) {
  const std::vector<Eigen::Vector3d> places{{300, 20, 30}, {900, 0, 0}, {500, -100, -90}};
  const CorrectedPlaces out = corrected_places(map, places);
  ASSERT_EQ(out.places_mm.size(), 2U);
  EXPECT_EQ(out.places_mm[1], places[2] + *map.correction_mm(places[2]));
  ASSERT_EQ(out.unmapped.size(), 1U);
  EXPECT_EQ(out.unmapped[0].find("point 2: at 900, 0, 0 mm it is outside"), 0U) << out.unmapped[0];
}

}  // namespace
}  // namespace birdseye::host
