// `calibrate field` and `calibrate field check`, from the outside.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "calibration/record/field_map_file.hpp"
#include "tests/support/command.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/simulated_field.hpp"
#include "tests/support/simulated_pointer.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;

std::string pose_row(const Transform<Tracker, Sensor>& pose) {
  const Eigen::Quaterniond q = pose.quaternion();
  const Eigen::Vector3d& p = pose.translation();
  return fmt::format("{},{},{},{},{},{},{}", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

std::string grid_csv(const std::vector<calibration::FieldSample>& samples) {
  std::string out = "name,true_x,true_y,true_z,x,y,z,qx,qy,qz,qw\n";
  for (const auto& s : samples) {
    out += fmt::format("{},{},{},{},{}\n", s.name.substr(s.name.find(' ') + 1), s.true_mm.x(), s.true_mm.y(),
                       s.true_mm.z(), pose_row(s.measured));
  }
  return out;
}

TEST(FieldCommand, FromTheTableToTheAppliance) {
  const Scratch scratch;
  const hw_sim::FieldDistortion field(10, 6);
  auto samples = testing::grid_samples(field, {}, 6);
  samples[70].measured = Transform<Tracker, Sensor>(
      samples[70].measured.rotation(), Eigen::Vector3d(samples[70].measured.translation() + Eigen::Vector3d(25, 0, 0)));
  std::string table = grid_csv(samples);
  table += "gone,1,2,3,-3.697314E28,-3.697314E28,-3.697314E28,0,0,0,1\nnan,1,2,3,nan,0,0,0,0,0,1\n";
  const std::string out = (scratch / "field.json").string();
  const auto made =
      run("birdseye", "calibrate field --grid " + scratch.file("grid.csv", table) + " --held-alike --out " + out +
                          " --json " + (scratch / "r.json").string() + " --report " + (scratch / "r.html").string());
  ASSERT_EQ(made.code, 0) << made.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["verdict"], "pass") << r["reasons"];
  EXPECT_LT(r["held_out_mm"].get<double>(), 0.8);
  EXPECT_GT(r["before_mm"].get<double>(), 2);
  EXPECT_LT(r["held_out_deg"].get<double>(), r["before_deg"].get<double>());
  EXPECT_GT(r["candidates"].size(), 8U);
  ASSERT_EQ(r["outliers"].size(), 1U) << r["outliers"];
  EXPECT_EQ(r["outliers"][0]["name"], "71");
  EXPECT_EQ(r["rejected"].size(), 2U) << r["rejected"];
  EXPECT_EQ(r["box_mm"].size(), 2U);
  const auto map = calibration::parse_field_map(testing::contents_of(out));
  ASSERT_TRUE(map) << map.error().what;
  EXPECT_EQ(map->notes.held_out_mm, r["held_out_mm"]);
  const std::string page = testing::contents_of(scratch / "r.html");
  EXPECT_NE(page.find("<svg"), std::string::npos);
  EXPECT_NE(page.find("outlier, not used"), std::string::npos);
  const auto checked = run("birdseyed", "--check --config " + scratch.file("cart.toml",
                                                                           "[tracker]\ndevice = \"/dev/ttyS0\"\n"
                                                                           "[camera]\nsource = \"v4l2:/dev/video0\"\n"
                                                                           "[calibration]\nfield = \"" +
                                                                               out + "\"\n"));
  EXPECT_EQ(checked.code, 0) << checked.output;
}

TEST(FieldCommand, LengthsInOtherUnitsAreTakenWhereTheyAreSaid) {
  const Scratch scratch;
  const auto samples = testing::grid_samples(hw_sim::FieldDistortion(10, 6), {}, 6);
  std::string metres, headed = "name,true_x [cm],true_y [cm],true_z [cm],tx (m),ty (m),tz (m)\n";
  std::string mm = "name,true_x,true_y,true_z,x,y,z\n";
  metres = mm;
  for (const auto& sample : samples) {
    const Eigen::Vector3d &truth = sample.true_mm, &seen = sample.measured.translation();
    mm += fmt::format("a,{},{},{},{},{},{}\n", truth.x(), truth.y(), truth.z(), seen.x(), seen.y(), seen.z());
    metres += fmt::format("a,{},{},{},{},{},{}\n", truth.x(), truth.y(), truth.z(), seen.x() / 1000, seen.y() / 1000,
                          seen.z() / 1000);
    headed += fmt::format("a,{},{},{},{},{},{}\n", truth.x() / 10, truth.y() / 10, truth.z() / 10, seen.x() / 1000,
                          seen.y() / 1000, seen.z() / 1000);
  }
  const std::string common = "calibrate field --json " + (scratch / "r.json").string() + " --grid ";
  const auto held_out_mm = [&](const std::string& arguments) {
    const auto made = run("birdseye", common + arguments);
    EXPECT_EQ(made.code, 0) << made.output;
    return read_json(scratch / "r.json")["held_out_mm"].get<double>();
  };
  const double truth_mm = held_out_mm(scratch.file("mm.csv", mm));
  EXPECT_NEAR(held_out_mm(scratch.file("m.csv", metres) + " --unit m"), truth_mm, 1e-6);
  EXPECT_NEAR(held_out_mm(scratch.file("h.csv", headed)), truth_mm, 1e-6);
  expect_refused("birdseye", common + scratch.file("u.csv", metres), {"--unit m"});
  expect_refused("birdseye", common + scratch.file("o.csv", mm) + " --tool a", {"--tool goes with --poses or --pair"});
  expect_refused("birdseye", common + scratch.file("o.csv", mm) + " --distance 9", {"--distance goes with --pair"});
}

TEST(FieldCommand, PosesInTheOrderOfTheNodes) {
  const Scratch scratch;
  const hw_sim::FieldDistortion field(10, 2);
  std::string poses = "t,x,y,z,qx,qy,qz,qw\n";
  const auto samples = testing::grid_samples(field, {}, 2);
  for (std::size_t i = 0; i < samples.size(); ++i)
    poses += fmt::format("{},{}\n", i, i == 10 ? "nan,nan,nan,0,0,0,1" : pose_row(samples[i].measured));
  const std::string common = "calibrate field --poses " + scratch.file("p.csv", poses) + " --kind polynomial --json " +
                             (scratch / "r.json").string() + " --grid-spec ";
  const auto made = run("birdseye", common + "6x6x5:100x96x100mm");
  ASSERT_EQ(made.code, 0) << made.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["kind"], "polynomial");
  EXPECT_LT(r["held_out_mm"].get<double>(), 0.8);
  EXPECT_EQ(r["measurements"], 179);
  EXPECT_EQ(r["rejected"].size(), 1U);
  expect_refused("birdseye", common + "6x6x6:100x96x100mm", {"180 poses for 216 nodes"});
  expect_refused("birdseye", common + "6x6x5", {"6x6x5:100mm"});
  expect_refused("birdseye", common + "6x6x5:0.1x0.096x0.1mm", {"--unit m"});
}

TEST(FieldCommand, TwoSensorsOnABar) {
  const Scratch scratch;
  const hw_sim::FieldDistortion field(10, 1);
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> part(0, 1);
  std::string a = "t,x,y,z,qx,qy,qz,qw\n", b = a;
  for (int i = 0; i < 400; ++i) {
    const Eigen::Vector3d place(220 + 300 * part(rng), 300 * part(rng) - 150, 240 * part(rng) - 120);
    const Eigen::Matrix3d turn = rotation_exp(Eigen::Vector3d(2 * part(rng) - 1, 2 * part(rng) - 1, 2 * part(rng) - 1));
    const Transform<Tracker, Sensor> first(turn, place), second(turn, Eigen::Vector3d(place + 120 * turn.col(0)));
    a += fmt::format("{:.3f},{}\n", 100 + 0.02 * i, pose_row(testing::measured(field, first, 0.3, 0.1, rng)));
    if (i != 7)
      b += fmt::format("{:.3f},{}\n", 100.002 + 0.02 * i, pose_row(testing::measured(field, second, 0.3, 0.1, rng)));
  }
  const std::string common = "calibrate field --kind polynomial --json " + (scratch / "r.json").string() + " --pair " +
                             scratch.file("a.csv", a) + " ";
  const auto made =
      run("birdseye", common + scratch.file("b.csv", b) + " --distance 120 --out " + (scratch / "field.json").string());
  ASSERT_EQ(made.code, 0) << made.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_NE(r["verdict"], "fail") << r["reasons"];
  EXPECT_EQ(r["measurements"], 399);
  EXPECT_NEAR(r["sensor_distance_mm"].get<double>(), 120, 0.5);
  EXPECT_LT(r["held_out_mm"].get<double>(), r["before_mm"].get<double>());
  EXPECT_TRUE(fs::exists(scratch / "field.json"));
}

TEST(FieldCommand, WhatIsNotWorthAMapIsNotWritten) {
  const Scratch scratch;
  testing::GridSpec noisy;
  noisy.noise_mm = 8;
  const auto samples = testing::grid_samples(hw_sim::FieldDistortion(1, 1), noisy, 1);
  const auto made = run("birdseye", "calibrate field --grid " + scratch.file("g.csv", grid_csv(samples)) + " --out " +
                                        (scratch / "field.json").string() + " --json " + (scratch / "r.json").string());
  EXPECT_EQ(made.code, 3) << made.output;
  EXPECT_FALSE(fs::exists(scratch / "field.json"));
  EXPECT_EQ(read_json(scratch / "r.json")["verdict"], "fail");
  EXPECT_FALSE(read_json(scratch / "r.json")["next_steps"].empty());
}

TEST(FieldCommand, InputThatCannotBeUsedIsRefused) {
  const Scratch scratch;
  const std::string out = (scratch / "f.json").string();
  const auto refused = [&](const std::string& arguments, const std::vector<std::string>& words) {
    expect_refused("birdseye", "calibrate field --out " + out + " " + arguments, words, out);
  };
  refused("", {"--grid", "--pair"});
  refused("--grid " + (scratch / "none.csv").string(), {"none.csv", "no such file"});
  refused("--grid " + scratch.file("a.csv", "x,y,z\n1,2,3\n"), {"a.csv", "true_x"});
  refused("--grid " + scratch.file("b.csv", "true_x,true_y,true_z,x,y,z\n1,2,3,4,5,6\n"), {"b.csv", "1 samples"});
  refused("--grid " + scratch.file("c.csv", "true_x,true_y,true_z,x,y,z\n1,2,3,nan,5,6\n"), {"c.csv", "no row"});
  refused("--kind spline --grid x", {"spline"});
}

/// A bent field, and the map that `calibrate field` makes of it.
class MappedByCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto made = run("birdseye", "calibrate field --grid " +
                                          scratch.file("grid.csv", grid_csv(testing::grid_samples(field, {}, 6))) +
                                          " --held-alike --out " + map);
    ASSERT_EQ(made.code, 0) << made.output;
  }
  [[nodiscard]] Transform<Tracker, Sensor> bent(const Transform<Tracker, Sensor>& truth) const {
    const hw_sim::BirdPose out = field.apply({truth.rotation(), truth.translation()});
    return {out.rotation, out.position_mm};
  }
  [[nodiscard]] Eigen::Vector3d bent_place(const Eigen::Vector3d& truth) const {
    return bent(Transform<Tracker, Sensor>(Eigen::Matrix3d::Identity(), truth)).translation();
  }
  const Scratch scratch;
  const hw_sim::FieldDistortion field{10, 6};
  const std::string map = (scratch / "field.json").string();
};

TEST_F(MappedByCommand, APointersTipIsFoundByCorrectedPoses) {
  calibration::SimulatedPointer pointer;
  std::string poses = "x,y,z,qx,qy,qz,qw\n";
  for (const auto& pose : pointer.poses(60)) poses += pose_row(bent(pose.tracker_from_sensor)) + "\n";
  poses += "1900,0,0,0,0,0,1\n";
  const auto off_mm = [&](const std::string& more) {
    const auto done = run("birdseye", "calibrate tip --poses " + scratch.file("p.csv", poses) + more + " --json " +
                                          (scratch / "tip.json").string());
    EXPECT_NE(done.code, 2) << done.output;
    const auto tip = read_json(scratch / "tip.json")["tip_in_sensor_mm"].get<std::vector<double>>();
    return std::pair((Eigen::Vector3d(tip[0], tip[1], tip[2]) - pointer.tip_mm).norm(), done.output);
  };
  const auto [raw_mm, raw] = off_mm("");
  const auto [corrected_mm, corrected] = off_mm(" --field " + map);
  EXPECT_LT(corrected_mm, 0.5 * raw_mm);
  EXPECT_NE(corrected.find("1 of 61 poses lie where the field was not mapped"), std::string::npos) << corrected;
  expect_refused("birdseye", "calibrate tip --server 127.0.0.1:1 --field " + map, {"--field goes with --poses"});
  expect_refused("birdseye",
                 "calibrate tip --poses " + scratch.file("p.csv", poses) + " --field " + scratch.file("no.json", "{}"),
                 {"no.json"});
}

TEST_F(MappedByCommand, AMapOfNobodyKnownIsUsedOnlyWhenAskedTo) {
  calibration::SimulatedPointer pointer;
  std::string poses = "x,y,z,qx,qy,qz,qw\n";
  for (const auto& pose : pointer.poses(60)) poses += pose_row(bent(pose.tracker_from_sensor)) + "\n";
  const std::string tip = "calibrate tip --poses " + scratch.file("p.csv", poses) + " --field ";
  const std::string fiducials = "register fiducials --out " + (scratch / "p.txt").string() + " --ct " +
                                scratch.file("ct.txt", "0 0 0\n100 0 0\n0 80 0\n0 0 60\n") + " --tracker " +
                                scratch.file("touched.txt", "300 0 0\n400 0 0\n300 80 0\n300 0 60\n") + " --field ";
  const auto own = calibration::parse_field_map(testing::contents_of(map));
  ASSERT_TRUE(own && own->signature);
  const std::string nobodys = scratch.file("nobodys.json", calibration::field_map_text(own->map, own->notes));
  auto notes = own->notes;
  notes.held_out_mm /= 2;
  const std::string changed =
      scratch.file("changed.json", calibration::field_map_text(own->map, notes, own->signature));
  for (const std::string& command : {tip, fiducials}) {
    expect_refused("birdseye", command + nobodys, {"nobodys.json: the map of the field is not signed"});
    const auto used = run("birdseye", command + nobodys + " --accept-unsigned");
    EXPECT_NE(used.code, 2) << used.output;
    EXPECT_NE(used.output.find("UNSIGNED: the map of the field is not signed"), std::string::npos) << used.output;
    EXPECT_EQ(used.output.find("verdict: pass"), std::string::npos) << used.output;
    expect_refused("birdseye", command + changed + " --accept-unsigned", {"changed.json: ", "was changed since"});
    const auto by_own = run("birdseye", command + map);
    EXPECT_NE(by_own.code, 2) << by_own.output;
    EXPECT_EQ(by_own.output.find("UNSIGNED"), std::string::npos) << by_own.output;
  }
  // What is entered into a record says what it rests on, whoever signs that.
  const std::string record = (scratch / "record.json").string();
  const auto entered = run("birdseye", tip + nobodys + " --accept-unsigned --record " + record);
  EXPECT_NE(entered.code, 2) << entered.output;
  const auto verified = run("birdseye", "verify " + record);
  EXPECT_EQ(verified.code, 3) << verified.output;
  EXPECT_NE(verified.output.find("rests on what no known machine had signed: its tip: the map of the field is not"),
            std::string::npos)
      << verified.output;
  for (const char* const command :
       {"calibrate latency --poses a.csv --eye-poses b.csv", "calibrate hand-eye --poses a.csv --eye-poses b.csv"})
    expect_refused("birdseye", command + (" --field " + nobodys), {"nobodys.json: the map of the field is not signed"});
}

TEST_F(MappedByCommand, TheApplianceAndTheDailyCheckSayThatNobodyKnownSignedAMap) {
  const auto own = calibration::parse_field_map(testing::contents_of(map));
  ASSERT_TRUE(own);
  const std::string nobodys = scratch.file("nobodys.json", calibration::field_map_text(own->map, own->notes));
  const std::string cart =
      "[tracker]\ndevice = \"/dev/ttyS0\"\n[camera]\nsource = \"v4l2:/dev/video0\"\n"
      "[calibration]\nfield = \"" +
      nobodys + "\"\n";
  const auto told = run("birdseyed", "--check --config " + scratch.file("cart.toml", cart));
  EXPECT_EQ(told.code, 0);
  EXPECT_NE(told.output.find("nobodys.json: the map of the field is not signed"), std::string::npos) << told.output;
  EXPECT_NE(told.output.find("sound, but no pose will be published"), std::string::npos) << told.output;
  const std::string plate = scratch.file("plate.csv", "name,x,y,z\nd1,0,0,0\nd2,80,0,0\nd3,0,80,0\nd4,80,80,0\n");
  const std::string check = "calibrate field check --plate " + plate + " --measured " +
                            scratch.file("m.csv", "name,x,y,z\nd1,300,0,0\nd2,380,0,0\nd3,300,80,0\nd4,380,80,0\n") +
                            " --history " + (scratch / "h.csv").string() + " --field ";
  const auto checked = run("birdseye", check + nobodys);
  EXPECT_NE(checked.output.find("UNSIGNED: the map of the field is not signed"), std::string::npos) << checked.output;
  EXPECT_NE(checked.output.find("verdict: marginal"), std::string::npos) << checked.output;
  EXPECT_NE(run("birdseye", check + nobodys).output.find("replaces today's former"), std::string::npos);
  auto notes = own->notes;
  notes.held_out_mm /= 2;
  expect_refused("birdseye",
                 check + scratch.file("changed.json", calibration::field_map_text(own->map, notes, own->signature)),
                 {"changed.json: ", "was changed since"});
}

TEST_F(MappedByCommand, WithoutAKeyTheMapAloneIsNotWritten) {
  const auto done = run("birdseye",
                        "calibrate field --grid " + (scratch / "grid.csv").string() + " --held-alike --out " +
                            (scratch / "unsigned.json").string() + " --json " + (scratch / "r.json").string(),
                        "env -u BIRDSEYE_IDENTITY -u STATE_DIRECTORY -u XDG_CONFIG_HOME -u HOME");
  EXPECT_EQ(done.code, 2) << done.output;
  EXPECT_NE(done.output.find("unsigned.json: "), std::string::npos) << done.output;
  EXPECT_FALSE(fs::exists(scratch / "unsigned.json"));
  EXPECT_TRUE(fs::exists(scratch / "r.json"));
}

TEST_F(MappedByCommand, TouchedFiducialsAreCorrectedAndThoseBeyondTheMapRefused) {
  const std::vector<Eigen::Vector3d> markers{{200, -150, -90}, {500, -120, 60},  {350, 140, -40},
                                             {250, 90, 120},   {560, 160, -110}, {420, -10, 20}};
  std::string ct, touched;
  for (const Eigen::Vector3d& m : markers) {
    const Eigen::Vector3d seen = bent_place(m);
    ct += fmt::format("{} {} {}\n", m.x(), m.y(), m.z());
    touched += fmt::format("{} {} {}\n", seen.x(), seen.y(), seen.z());
  }
  const std::string common = "register fiducials --out " + (scratch / "p.txt").string() + " --json " +
                             (scratch / "r.json").string() + " --ct " + scratch.file("ct.txt", ct) + " --tracker ";
  const std::string tracker = scratch.file("touched.txt", touched);
  const auto fre_mm = [&](const std::string& more) {
    const auto done = run("birdseye", common + tracker + more);
    EXPECT_NE(done.code, 2) << done.output;
    return read_json(scratch / "r.json")["fre_rms_mm"].get<double>();
  };
  const double raw_mm = fre_mm("");
  EXPECT_LT(fre_mm(" --field " + map), 0.3 * raw_mm);
  expect_refused(
      "birdseye",
      common + scratch.file("far.txt", touched.substr(0, touched.rfind('\n', touched.size() - 2)) + "\n900 0 0\n") +
          " --field " + map,
      {"far.txt: 1 of 6 points lie where the field was not mapped (point 6: at 900, 0, 0 mm"});
}

std::string places_csv(double bend_mm, unsigned seed) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> noise(0, 0.2);
  std::string out = "name,x,y,z\n";
  for (int i = 0; i < 6; ++i) {
    const double x = 80 * (i % 3), y = 110 * (i / 3);
    out += fmt::format("d{},{},{},{}\n", i + 1, 300 + y + noise(rng), x + noise(rng) + (i == 5 ? bend_mm : 0),
                       -40 + noise(rng));
  }
  return out;
}

TEST(FieldCheckCommand, DayByDayUntilMetalComes) {
  const Scratch scratch;
  std::string plate = "name,x,y,z\n";
  for (int i = 0; i < 6; ++i) plate += fmt::format("d{},{},{},0\n", i + 1, 80 * (i % 3), -110 * (i / 3));
  const std::string history = (scratch / "history.csv").string();
  const std::string common = "calibrate field check --plate " + scratch.file("plate.csv", plate) + " --history " +
                             history + " --json " + (scratch / "r.json").string() + " --report " +
                             (scratch / "r.html").string() + " --measured ";
  for (unsigned day = 1; day <= 10; ++day) {
    const auto done =
        run("birdseye", common + scratch.file("m.csv", places_csv(0, day)) + fmt::format(" --when 2026-11-{:02}", day));
    ASSERT_EQ(done.code, 0) << done.output;
  }
  const auto bent = run("birdseye", common + scratch.file("m.csv", places_csv(3.5, 99)) + " --when 2026-11-11T08:30");
  EXPECT_EQ(bent.code, 3) << bent.output;
  const nlohmann::json r = read_json(scratch / "r.json");
  EXPECT_EQ(r["verdict"], "fail");
  EXPECT_EQ(r["days"], 11);
  EXPECT_EQ(r["worst"], "d6");
  EXPECT_GT(r["rms_mm"].get<double>(), r["limits"]["rms_mm"]["high"].get<double>());
  const std::string kept = testing::contents_of(history);
  EXPECT_EQ(std::count(kept.begin(), kept.end(), '\n'), 12);
  EXPECT_NE(kept.find("\n2026-11-11T08:30,"), std::string::npos);
  EXPECT_NE(testing::contents_of(scratch / "r.html").find("+3 sigma"), std::string::npos);
}

TEST(FieldCheckCommand, InputThatCannotBeUsedIsRefusedAndNoDayIsAdded) {
  const Scratch scratch;
  const std::string plate = scratch.file("plate.csv", "name,x,y,z\nd1,0,0,0\nd2,80,0,0\nd3,0,80,0\nd4,80,80,0\n");
  const fs::path history = scratch / "h.csv";
  const std::string common =
      "calibrate field check --plate " + plate + " --history " + history.string() + " --measured ";
  expect_refused("birdseye", common + scratch.file("a.csv", "name,x,y,z\nd1,0,0,0\nd9,80,0,0\n"), {"d9", "plate.csv"},
                 history);
  expect_refused("birdseye", common + scratch.file("b.csv", "name,x,y,z\nd1,0,0,0\nd2,80,0,0\n"), {"2 places"},
                 history);
  expect_refused("birdseye", common + scratch.file("c.csv", "name,x,y,z\nd1,0,zero,0\n"), {"c.csv:2"}, history);
  const std::string whole = "name,x,y,z\nd1,0,0,0\nd2,80,0,0\nd3,0,80,0\nd4,80,80,0\n";
  expect_refused("birdseye",
                 common + scratch.file("twice.csv", "name,x,y,z\nd1,0,0,0\nd2,80,0,0\nd3,0,80,0\nd1,80,80,0\n"),
                 {"twice.csv: has \"d1\" twice"}, history);
  expect_refused("birdseye",
                 "calibrate field check --plate " + scratch.file("plate2.csv", whole + "d2,1,0,0\n") + " --history " +
                     history.string() + " --measured " + scratch.file("w.csv", whole),
                 {"plate2.csv: has \"d2\" twice"}, history);
  for (const std::string day : {"blah", "2026-02-30", "2026-11-1", "2026-11-29T24:00"})
    expect_refused("birdseye", common + scratch.file("w.csv", whole) + " --when " + day,
                   {"--when", day + "\" is no day", "2026-11-29"}, history);
  expect_refused("birdseye",
                 common + scratch.file("w.csv", whole) + " --json " + (scratch / "no_folder/r.json").string(),
                 {"r.json"}, history);
  std::ofstream(history) << "when,rms_mm,scale_percent,worst_mm,worst_place\n2026-11-01,0.1,0,0.1,d1\n";
  expect_refused("birdseye", common + scratch.file("w.csv", whole) + " --when 2026-11-01",
                 {"h.csv", "has a day 2026-11-01 already", "--when"});
  std::ofstream(history) << "when,rms_mm,scale_percent,worst_mm,worst_place\nmonday,much,0,0,d1\n";
  expect_refused("birdseye", common + scratch.file("w.csv", whole), {"h.csv:2"});
}

}  // namespace
}  // namespace birdseye
