// `calibrate tip`, from the outside.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calibration/record/calibration_record.hpp"
#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/example_record.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/simulated_pointer.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using calibration::PivotPose;
using calibration::SimulatedPointer;
using testing::contents_of;
using ::testing::HasSubstr;
using testing::read_json;
using testing::run;
using testing::Scratch;

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  const auto v = json.get<std::vector<double>>();
  return {v.at(0), v.at(1), v.at(2)};
}

std::string csv_row(const PivotPose& pose, double units_per_mm = 1) {
  const Eigen::Vector3d p = units_per_mm * pose.tracker_from_sensor.translation();
  const Eigen::Quaterniond q = pose.tracker_from_sensor.quaternion();
  return fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", pose.time_s, p.x(), p.y(),
                     p.z(), q.x(), q.y(), q.z(), q.w());
}

std::string csv_of(const std::vector<PivotPose>& poses, double units_per_mm = 1) {
  std::string text = "t,x,y,z,qx,qy,qz,qw\n";
  for (const PivotPose& pose : poses) text += csv_row(pose, units_per_mm);
  return text;
}

/// The command on poses, with all that it writes into scratch.
std::string command(const Scratch& scratch, const std::string& poses) {
  return "calibrate tip --out " + (scratch / "tip.txt").string() + " --json " + (scratch / "tip.json").string() +
         " --report " + (scratch / "tip.html").string() + " --poses " + poses;
}

TEST(CalibrateTip, FindsTheTipAndNamesWhatIsWrong) {
  const Scratch scratch;
  SimulatedPointer pointer{.position_noise_mm = 0.2};
  auto poses = pointer.poses(60);
  for (const std::size_t i : {10U, 40U})
    poses[i].tracker_from_sensor = {poses[i].tracker_from_sensor.rotation(), Eigen::Vector3d(9, 9, 9)};
  const std::string text = csv_of(poses) + "100,-3.697314E28,0,0,0,0,0,1\n101,missing\n102,nan,0,0,0,0,0,1\n";
  const auto result = run("birdseye", command(scratch, scratch.file("p.csv", text)));
  ASSERT_EQ(result.code, 0) << result.output;
  const auto json = read_json(scratch / "tip.json");
  EXPECT_EQ(json["verdict"], "pass") << result.output;
  EXPECT_LT((vector_of(json["tip_in_sensor_mm"]) - pointer.tip_mm).norm(), 0.5);
  EXPECT_LT((vector_of(json["pivot_in_tracker_mm"]) - pointer.pivot_mm).norm(), 0.5);
  EXPECT_GT(json["algebraic"]["rms_mm"], json["rms_mm"]);
  EXPECT_NEAR(json["rms_mm"].get<double>(), json["component_rms_mm"].get<double>() * std::sqrt(3.0), 1e-9);
  // Poses on lines 12 and 42: the header is the first.
  const auto outliers = json["outliers"].get<std::vector<std::string>>();
  EXPECT_EQ(std::count(outliers.begin(), outliers.end(), "line 12"), 1) << json["outliers"];
  EXPECT_EQ(std::count(outliers.begin(), outliers.end(), "line 42"), 1) << json["outliers"];
  ASSERT_EQ(json["rejected"].size(), 3U);
  EXPECT_EQ(json["rejected"][1]["name"], "line 63");
  EXPECT_EQ(json["rejected"][1]["reason"], "missing");
  EXPECT_NE(result.output.find("line 12"), std::string::npos);
  EXPECT_NE(result.output.find("line 64: not finite"), std::string::npos);
  for (const char* key : {"sigma", "held_out_mm", "tilt_deg", "weakest", "slid", "residuals", "reasons", "next_steps"})
    EXPECT_TRUE(json.contains(key)) << key;
  // The tip as text, read back.
  std::ifstream in(scratch / "tip.txt");
  std::string line;
  while (in.peek() == '#') std::getline(in, line);
  double x = 0, y = 0, z = 0;
  in >> x >> y >> z;
  EXPECT_EQ(Eigen::Vector3d(x, y, z), vector_of(json["tip_in_sensor_mm"]));
  const std::string page = contents_of(scratch / "tip.html");
  EXPECT_NE(page.find("class='verdict pass'"), std::string::npos);
  for (std::size_t figures = 0, at = 0; figures < 3; ++figures, ++at) {
    at = page.find("<svg", at);
    ASSERT_NE(at, std::string::npos) << figures;
  }
  EXPECT_NE(page.find("line 12</td>"), std::string::npos);
  EXPECT_EQ(page.find("='nan"), std::string::npos);
}

TEST(CalibrateTip, MetresAndAnotherOrderGiveTheSameTip) {
  const Scratch scratch;
  SimulatedPointer pointer{.position_noise_mm = 0.2};
  auto poses = pointer.poses(60);
  ASSERT_EQ(run("birdseye", command(scratch, scratch.file("p.csv", csv_of(poses)))).code, 0);
  const auto tip = vector_of(read_json(scratch / "tip.json")["tip_in_sensor_mm"]);
  std::shuffle(poses.begin(), poses.end(), pointer.random);
  const std::string metres = scratch.file("m.csv", csv_of(poses, 1e-3));
  ASSERT_EQ(run("birdseye", command(scratch, metres) + " --unit m").code, 0);
  EXPECT_LT((vector_of(read_json(scratch / "tip.json")["tip_in_sensor_mm"]) - tip).norm(), 1e-9);
  fs::remove(scratch / "tip.txt");
  const auto unscaled = run("birdseye", command(scratch, metres));
  EXPECT_EQ(unscaled.code, 3) << unscaled.output;
  EXPECT_NE(unscaled.output.find("if the poses are in metres, say so: --unit m"), std::string::npos);
  EXPECT_FALSE(fs::exists(scratch / "tip.txt"));
}

TEST(CalibrateTip, ASpinGivesTheShaft) {
  const Scratch scratch;
  SimulatedPointer pointer{.position_noise_mm = 0.2};
  const std::string pivot = scratch.file("p.csv", csv_of(pointer.poses(60)));
  const Eigen::Vector3d axis = Eigen::Vector3d(0.1, -0.05, 1).normalized();
  std::vector<PivotPose> spun;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Matrix3d rotation =
        rotation_exp(pointer.noise(0.005)) * Eigen::AngleAxisd(0.15 * i, axis).toRotationMatrix();
    spun.push_back({{rotation, Eigen::Vector3d(pointer.pivot_mm - rotation * pointer.tip_mm)}, 0, 0.1 * i});
  }
  const std::string common = command(scratch, pivot) + " --spin ";
  const auto result = run("birdseye", common + scratch.file("s.csv", csv_of(spun)));
  ASSERT_EQ(result.code, 0) << result.output;
  const auto found = read_json(scratch / "tip.json")["axis"];
  EXPECT_LT(std::acos(vector_of(found["axis_in_sensor"]).dot(axis)) * kDegPerRad,
            std::max(0.3, 4 * found["sigma_deg"].get<double>()));
  EXPECT_NE(contents_of(scratch / "tip.txt").find("# its shaft"), std::string::npos);
  EXPECT_NE(contents_of(scratch / "tip.html").find("The shaft"), std::string::npos);
  // Too little of a turn is no axis.
  spun.resize(8);
  const auto little = run("birdseye", common + scratch.file("l.csv", csv_of(spun)));
  EXPECT_EQ(little.code, 3) << little.output;
  EXPECT_NE(little.output.find("spun through"), std::string::npos);
}

TEST(CalibrateTip, PosesNotWorthATipFailWithAJson) {
  const Scratch scratch;
  SimulatedPointer still{.tilt_deg = 2, .sideways_deg = 2, .position_noise_mm = 0.1};
  SimulatedPointer hinge{.sideways_deg = 0, .position_noise_mm = 0.1};
  for (const auto& [poses, words] : {std::pair{SimulatedPointer().poses(3), "3 poses: a pivot needs at least 4"},
                                     {still.poses(60), "tilted through"},
                                     {hinge.poses(60), "turned about no more than one axis"}}) {
    const auto result = run("birdseye", command(scratch, scratch.file("p.csv", csv_of(poses))));
    EXPECT_EQ(result.code, 3) << result.output;
    EXPECT_NE(result.output.find(words), std::string::npos) << result.output;
    EXPECT_EQ(read_json(scratch / "tip.json")["verdict"], "fail");
    EXPECT_NE(contents_of(scratch / "tip.html").find("class='verdict fail'"), std::string::npos);
    EXPECT_FALSE(fs::exists(scratch / "tip.txt"));
  }
}

TEST(CalibrateTip, InputThatCannotBeUsedIsRefusedInOneLine) {
  const Scratch scratch;
  const std::string good = scratch.file("p.csv", csv_of(SimulatedPointer().poses(40)));
  for (const auto& [arguments, words] :
       {std::pair{(scratch / "none").string(), "no such file or folder"},
        {scratch.file("e.csv", "1,nan,0,0,0,0,0,1\n"), "its one pose cannot be used; line 1: not finite"},
        {scratch.file("two.mha",
                      "Seq_Frame0000_AToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"
                      "Seq_Frame0000_BToTrackerTransform = 1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n"),
         "it holds AToTracker, BToTracker"},
        {good + " --reference ReferenceToTracker", "holds no transforms"},
        {good + " --phases 1-5,4-9", "4-9 overlaps 1-5"},
        {good + " --phases 5-1", "\"5-1\" is no first-last"},
        {good + " --phases 0-39,100-200", "100-200 goes beyond the"},
        {good + " --spin " + (scratch / "no.csv").string(), "no such file"}}) {
    testing::expect_refused("birdseye", command(scratch, arguments), {words}, scratch / "tip.txt");
  }
}

/// Who enters something signs all of the record.
TEST(CalibrateTip, ARecordOfNobodyKnownIsRefusedBeforeTheWork) {
  const Scratch scratch;
  const std::string record =
      scratch.file("record.json", calibration::record_text(testing::example_record(768, 576, {}, {})));
  const std::string before = contents_of(record);
  const std::string tip = command(scratch, scratch.file("none.csv", "no poses\n")) + " --record " + record;
  testing::expect_refused("birdseye", tip, {"--record: " + record + ": the calibration record is not signed"});
  testing::expect_refused("birdseye", tip + " --accept-unsigned", {"none.csv"});
  EXPECT_EQ(contents_of(record), before);
}

TEST(CalibrateTip, WhatWouldBeOfNoEffectIsRefusedByName) {
  const Scratch scratch;
  const std::string good = scratch.file("p.csv", csv_of(SimulatedPointer().poses(40)));
  for (const char* option : {"--bird pointer", "--seconds 5", "--tool Stylus", "--transform StylusToTracker"}) {
    testing::expect_refused("birdseye", command(scratch, good) + " " + option,
                            {std::string(option).substr(0, 6), "leave"}, scratch / "tip.txt");
  }
  for (const char* option : {"--reference ReferenceToTracker", "--unit m", "--max-error 1", "--time-unit ms"}) {
    const std::string name = std::string(option).substr(0, std::string(option).find(' '));
    testing::expect_refused("birdseye", "calibrate tip --server 127.0.0.1:1 " + std::string(option),
                            {name + " goes with --poses"});
  }
}

TEST(CalibrateTip, OfSeveralToolsInATableOneMustBeNamed) {
  const Scratch scratch;
  SimulatedPointer pointer{.position_noise_mm = 0.2};
  SimulatedPointer other{.tip_mm = {40, 8, -90}, .pivot_mm = {100, 300, 70}};
  std::string text = "tool,t,x,y,z,qx,qy,qz,qw\n";
  const auto of_pointer = pointer.poses(60), of_other = other.poses(60);
  for (std::size_t i = 0; i < of_pointer.size(); ++i)
    text += "Pointer," + csv_row(of_pointer[i]) + "Scope," + csv_row(of_other[i]);
  const std::string mixed = command(scratch, scratch.file("p.csv", text));
  testing::expect_refused("birdseye", mixed, {"p.csv", "--tool NAME", "Pointer (60 rows), Scope (60 rows)"},
                          scratch / "tip.txt");
  const auto one = run("birdseye", mixed + " --tool Pointer");
  ASSERT_EQ(one.code, 0) << one.output;
  EXPECT_LT((vector_of(read_json(scratch / "tip.json")["tip_in_sensor_mm"]) - pointer.tip_mm).norm(), 0.5);
}

TEST(CalibrateTip, InvertedPosesFailUntilSomebodySaysWhichWayTheyGo) {
  const Scratch scratch;
  SimulatedPointer pointer{.position_noise_mm = 0.2};
  auto poses = pointer.poses(60);
  for (PivotPose& pose : poses) {
    const auto back = pose.tracker_from_sensor.inverse();
    pose.tracker_from_sensor = {back.rotation(), back.translation()};
  }
  const std::string inverted = command(scratch, scratch.file("p.csv", csv_of(poses)));
  const auto doubted = run("birdseye", inverted);
  EXPECT_EQ(doubted.code, 3) << doubted.output;
  EXPECT_NE(doubted.output.find("the poses seem to be inverted"), std::string::npos) << doubted.output;
  EXPECT_NE(doubted.output.find("say --poses-are sensor_from_tracker"), std::string::npos) << doubted.output;
  EXPECT_FALSE(fs::exists(scratch / "tip.txt"));
  const auto told = run("birdseye", inverted + " --poses-are sensor_from_tracker");
  ASSERT_EQ(told.code, 0) << told.output;
  EXPECT_LT((vector_of(read_json(scratch / "tip.json")["tip_in_sensor_mm"]) - pointer.tip_mm).norm(), 0.5);
  // Who says that they are right is believed.
  EXPECT_EQ(run("birdseye", inverted + " --poses-are tracker_from_sensor").code, 0);
}

TEST(CalibrateTip, QuaternionsWithWFirstAreTold) {
  const Scratch scratch;
  std::string text = "t,x,y,z,qx,qy,qz,qw\n";
  for (const PivotPose& pose : SimulatedPointer{.position_noise_mm = 0.2}.poses(60)) {
    const Eigen::Vector3d& p = pose.tracker_from_sensor.translation();
    const Eigen::Quaterniond q = pose.tracker_from_sensor.quaternion();
    text += fmt::format("{},{},{},{},{},{},{},{}\n", pose.time_s, p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z());
  }
  const auto told = run("birdseye", command(scratch, scratch.file("p.csv", text)));
  EXPECT_EQ(told.code, 3) << told.output;
  EXPECT_NE(told.output.find("the quaternions seem to have w first"), std::string::npos) << told.output;
  EXPECT_NE(told.output.find("name the columns in a header: qw,qx,qy,qz"), std::string::npos) << told.output;
  EXPECT_EQ(
      run("birdseye", command(scratch, scratch.file("w.csv", "t,x,y,z,qw,qx,qy,qz" + text.substr(text.find('\n')))))
          .code,
      0);
}

TEST(CalibrateTip, RotationsThatDoNotGoWithThePositionsAreTold) {
  const Scratch scratch;
  const auto told = [&](const auto& change) {
    auto poses = SimulatedPointer{.position_noise_mm = 0.2}.poses(60);
    for (PivotPose& pose : poses) pose.tracker_from_sensor = change(pose.tracker_from_sensor);
    const auto result = run("birdseye", command(scratch, scratch.file("p.csv", csv_of(poses))));
    EXPECT_EQ(result.code, 3) << result.output;
    EXPECT_FALSE(fs::exists(scratch / "tip.txt"));
    return result.output;
  };
  using Pose = Transform<Tracker, Sensor>;
  EXPECT_THAT(told([](const Pose& p) { return Pose(Eigen::Matrix3d(p.rotation().transpose()), p.translation()); }),
              HasSubstr("the rotations seem to go the other way than the positions"));
  for (int axis = 0; axis < 3; ++axis) {
    const auto mirrored = [axis](const Pose& p) {
      Eigen::Vector3d position_mm = p.translation();
      position_mm[axis] = -position_mm[axis];
      return Pose(p.rotation(), position_mm);
    };
    EXPECT_THAT(told(mirrored), HasSubstr(fmt::format("with {} mirrored", "xyz"[axis])));
  }
}

TEST(CalibrateTip, PosesThatWereLeftOutAreInTheVerdict) {
  const Scratch scratch;
  const auto poses = SimulatedPointer{.position_noise_mm = 0.2}.poses(60);
  const auto verdict_with = [&](int left_out) {
    std::string text = csv_of(poses);
    for (int i = 0; i < left_out; ++i) text += "100,nan,nan,nan,0,0,0,1\n";
    return run("birdseye", command(scratch, scratch.file("p.csv", text))).output;
  };
  EXPECT_THAT(verdict_with(20), HasSubstr("verdict: pass"));
  EXPECT_THAT(verdict_with(20), HasSubstr("20 of 80 poses could not be read or used"));
  EXPECT_THAT(verdict_with(61), HasSubstr("verdict: marginal"));
}

TEST(CalibrateTip, CentimetresFailUntilTheyAreSaid) {
  const Scratch scratch;
  SimulatedPointer pointer{.position_noise_mm = 0.2};
  const std::string cm = command(scratch, scratch.file("p.csv", csv_of(pointer.poses(60), 0.1)));
  const auto doubted = run("birdseye", cm);
  EXPECT_EQ(doubted.code, 3) << doubted.output;
  EXPECT_FALSE(fs::exists(scratch / "tip.txt"));
  EXPECT_NE(doubted.output.find("--unit cm, --unit in"), std::string::npos) << doubted.output;
  // So are those of an optical tracker, a metre away, until somebody says that they are mm.
  pointer.tip_mm = {4, 3, -400};
  pointer.pivot_mm = {120, -40, -1100};
  const std::string far = command(scratch, scratch.file("far.csv", csv_of(pointer.poses(60), 0.1)));
  EXPECT_NE(run("birdseye", far).output.find("--unit cm, --unit in"), std::string::npos) << far;
  EXPECT_NE(run("birdseye", far + " --unit mm").output.find("verdict: pass"), std::string::npos) << far;
  pointer = SimulatedPointer{.position_noise_mm = 0.2};
  const auto told = run("birdseye", cm + " --unit cm");
  EXPECT_NE(told.output.find("verdict: pass"), std::string::npos) << told.output;
  EXPECT_LT((vector_of(read_json(scratch / "tip.json")["tip_in_sensor_mm"]) - pointer.tip_mm).norm(), 0.5);
}

TEST(CalibrateTip, RealRecordingsHaveTheirPublishedAnswers) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const Scratch scratch;
  ASSERT_EQ(run("birdseye", command(scratch, (*data / "pivot_optical_pointer").string())).code, 0);
  const auto optical = read_json(scratch / "tip.json");
  EXPECT_LT((vector_of(optical["algebraic"]["tip_in_sensor_mm"]) - Eigen::Vector3d(-14.473, 394.634, -7.407))
                .cwiseAbs()
                .maxCoeff(),
            6e-4);
  EXPECT_NEAR(optical["algebraic"]["component_rms_mm"].get<double>(), 1.761, 6e-4);
  EXPECT_LT(optical["component_rms_mm"].get<double>(), 1.3);
  EXPECT_EQ(optical["outliers"].size(), 5U);
  EXPECT_EQ(optical["verdict"], "marginal");

  const fs::path sequences = *data / "em_tracker_sequences";
  const auto joint = run(
      "birdseye", command(scratch, (sequences / "EightLandmarkPointsTrackedForPhantomRegistration.igs.mha").string()) +
                      " --transform StylusToTracker --reference ReferenceToTracker"
                      " --phases 77-162,172-253,275-352,361-456,530-612,624-715,725-819,831-929");
  ASSERT_EQ(joint.code, 0) << joint.output;
  const auto em = read_json(scratch / "tip.json");
  EXPECT_LT(
      (vector_of(em["algebraic"]["tip_in_sensor_mm"]) - Eigen::Vector3d(109.62, 6.56, 2.78)).cwiseAbs().maxCoeff(),
      0.006);
  EXPECT_NEAR(em["algebraic"]["component_rms_mm"].get<double>(), 0.318, 5e-4);
  EXPECT_EQ(em["pivots_in_tracker_mm"].size(), 8U);
  // An INVALID frame is named and has no residual.
  const auto probe = run("birdseye", command(scratch, (sequences / "TransformInterpolationTest.igs.mha").string()) +
                                         " --transform ProbeToTracker");
  EXPECT_EQ(probe.code, 3) << probe.output;
  const auto named = read_json(scratch / "tip.json");
  ASSERT_EQ(named["rejected"].size(), 1U);
  EXPECT_EQ(named["rejected"][0]["name"], "frame 7");
  EXPECT_EQ(named["rejected"][0]["reason"], "INVALID");
  ASSERT_EQ(named["residuals"].size(), 499U);
  for (const auto& pose : named["residuals"]) EXPECT_NE(pose["name"], "frame 7");
}

}  // namespace
}  // namespace birdseye
