#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>
#include <utility>
#include <vector>

#include "host/files/text_files.hpp"
#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "tests/support/cart_script.hpp"
#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_ct;

constexpr const char* kFour = "0 0 0\n100 0 0\n0 80 0\n10 20 60\n";

/// The programs share no code that could hold the list.
TEST(Commands, TheHostAndTheSimulatorKnowTheSameDeformations) {
  const std::vector<std::string> kinds{"elastic",     "bezier", "bend",      "push",
                                       "compression", "twist",  "breathing", "pneumoperitoneum"};
  expect_refused("birdseye", "demo --deformation melt", kinds);
  expect_refused("birdseye", "live --simulate --deformation melt", kinds);
  expect_refused("birdseye-sim", "cart --phantom p --socket s --tty t --out o --deformation melt", kinds);
}

/// What --help of a command lists of the options whose type is called so: the option, and how many numbers it takes.
struct ListedOption {
  std::string command, option;
  int numbers;
};

std::vector<ListedOption> options_of(const std::string& program, const std::string& command, const std::string& type) {
  const std::regex option("^  (?:-\\w,)?(--[\\w-]+)\\S* \\S*" + type + "\\b(?:.*? x (\\d))?.*");
  const std::regex name("^  (\\S+).*");
  std::vector<ListedOption> out;
  std::istringstream help(run(program, command + " --help").output);
  bool commands = false;
  std::smatch found;
  for (std::string line; std::getline(help, line);) {
    if (!line.empty() && line[0] != ' ') commands = line.starts_with("Subcommands:");
    if (commands && std::regex_match(line, found, name)) {
      for (ListedOption& one : options_of(program, command + " " + found[1].str(), type)) out.push_back(std::move(one));
    } else if (!commands && std::regex_match(line, found, option)) {
      out.push_back({command, found[1], found[2].matched ? std::stoi(found[2]) : 1});
    }
  }
  return out;
}

TEST(Commands, NoOptionTakesWhatIsNoNumber) {
  for (const auto& [program, least] : {std::pair("birdseye", 50U), std::pair("birdseye-sim", 40U)}) {
    const auto options = options_of(program, "", "FLOAT");
    EXPECT_GT(options.size(), least);
    for (const ListedOption& one : options) {
      std::string arguments = one.command + " " + one.option;
      for (int i = 0; i < one.numbers; ++i) arguments += " nan";
      expect_refused(program, arguments, {one.option, "nan is no number"});
    }
  }
}

TEST(Commands, NoCountIsBelowZero) {
  for (const auto& [program, least] : {std::pair("birdseye", 3U), std::pair("birdseye-sim", 5U)}) {
    const auto options = options_of(program, "", "UINT");
    EXPECT_GT(options.size(), least);
    for (const ListedOption& one : options)
      expect_refused(program, one.command + " " + one.option + " -1", {one.option, "-1"});
  }
}

/// An escape sequence in a name would move the terminal's cursor, or hide what stands there.
TEST(Commands, NamesFromFilesDoNotReachTheTerminalRaw) {
  const Scratch scratch;
  nlohmann::json places = nlohmann::json::array();
  for (const auto& [name, place] : std::vector<std::pair<std::string, std::vector<int>>>{
           {"a\x1b[2J", {0, 0, 0}}, {"b", {100, 0, 0}}, {"c", {0, 80, 0}}, {"d", {10, 20, 60}}})
    places.push_back({{"label", name}, {"position", place}});
  const nlohmann::json list = {{"type", "Fiducial"}, {"coordinateSystem", "LPS"}, {"controlPoints", places}};
  const std::string points =
      scratch.file("points.mrk.json", nlohmann::json{{"markups", nlohmann::json::array({list})}}.dump());
  const auto result = run("birdseye", "register fiducials --ct " + points + " --tracker " + points + " --out " +
                                          (scratch / "pose.txt").string());
  EXPECT_NE(result.output.find("fiducial  1 (a [2J)"), std::string::npos) << result.output;
  EXPECT_EQ(result.output.find('\x1b'), std::string::npos) << result.output;
}

TEST(Commands, VolumeInfoWritesItsFigures) {
  const Scratch scratch;
  const std::string json_path = (scratch / "info.json").string();
  const auto result = run("birdseye", "volume info " + small_ct(scratch) + " --json " + json_path);
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(json_path);
  EXPECT_EQ(json["size"], nlohmann::json({20, 20, 20}));
  EXPECT_EQ(json["hu_min"], -1000);
  EXPECT_EQ(json["hu_max"], 200);
  EXPECT_NEAR(json["patient_from_voxel"][2][3].get<double>(), -20, 1e-6);
  EXPECT_NEAR(json["spacing_mm"][2].get<double>(), 2, 1e-6);
  EXPECT_GT(json["hu_mean"].get<double>(), -1000);
}

TEST(Commands, VolumeInfoRefusesBadInputInOneLine) {
  const Scratch scratch;
  expect_refused("birdseye", "volume info " + (scratch / "none").string(), {"none", "no such file"});
  fs::create_directory(scratch / "empty");
  expect_refused("birdseye", "volume info " + (scratch / "empty").string(), {"empty"});
  expect_refused("birdseye", "volume info " + scratch.file("a.nii", "no"), {"a.nii"});
}

TEST(Commands, VolumeInfoListsSeriesAndLooksAtTheOneThatIsNamed) {
  const Scratch scratch;
  hw_sim::Grid grid;
  grid.size = {4, 3, 5};
  for (const int seed : {1, 2}) {
    const std::vector<std::int16_t> hu(grid.voxels(), static_cast<std::int16_t>(10 * seed));
    ASSERT_TRUE(hw_sim::write_dicom_series(scratch / fmt::format("export/S{}", seed), grid, hu,
                                           static_cast<std::uint64_t>(seed)));
  }
  const std::string folder = (scratch / "export").string(), json_path = (scratch / "info.json").string();
  const auto list = run("birdseye", "volume info " + folder + " --json " + json_path);
  EXPECT_EQ(list.code, 0) << list.output;
  EXPECT_EQ(std::count(list.output.begin(), list.output.end(), '\n'), 3) << list.output;
  const nlohmann::json json = read_json(json_path);
  ASSERT_EQ(json["series"].size(), 2U);
  EXPECT_EQ(json["series"][0]["id"], "1a");
  EXPECT_EQ(json["series"][1]["id"], "1b");
  EXPECT_EQ(json["series"][1]["size"], nlohmann::json({4, 3, 5}));
  EXPECT_EQ(json["series"][1]["readable"], true);
  EXPECT_FALSE(json.contains("hu_max"));
  const auto second = run("birdseye", "volume info " + folder + " --series 1b --json " + json_path);
  EXPECT_EQ(second.code, 0) << second.output;
  EXPECT_EQ(read_json(json_path)["hu_max"], 20);
  const auto none = run("birdseye", "volume info " + folder + " --series portal");
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.output.find("--series portal: there is no such series; name one of 1a, 1b"), std::string::npos)
      << none.output;
  const auto both = run("birdseye", "volume info " + folder + " --series 1");
  EXPECT_EQ(both.code, 2);
  EXPECT_NE(both.output.find("--series 1 fits 2 (1a, 1b)"), std::string::npos) << both.output;
  expect_refused("birdseye", "volume segment " + folder + " --hu 0,50 --out " + (scratch / "a.nii.gz").string(),
                 {"holds 2 series", "--series"}, scratch / "a.nii.gz");
  const auto segmented =
      run("birdseye", "volume segment " + folder + " --series 1b --hu 15,25 --out " + (scratch / "a.nii.gz").string());
  EXPECT_EQ(segmented.code, 0) << segmented.output;
}

TEST(Commands, ShowLabelsByName) {
  const Scratch scratch;
  const std::string ct = small_ct(scratch);
  hw_sim::Grid grid;
  grid.size = {20, 20, 20};
  grid.spacing_mm = {2, 2, 2};
  grid.origin_mm = {-20, -20, -20};
  std::vector<std::uint8_t> labels(grid.voxels(), 0);
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) labels[grid.index(i, j, k)] = grid.point(i, j, k).norm() < 8 ? 5 : 64;
    }
  }
  ASSERT_TRUE(hw_sim::write_labels(scratch / "labels.nii.gz", grid, labels));
  const auto render = [&](const std::string& shown, const std::string& out) {
    return run("birdseye", "render --volume " + ct + " --labels " + (scratch / "labels.nii.gz").string() + " --show " +
                               shown + " --size 64x64 --transfer liver --out " + (scratch / out).string());
  };
  const auto named = render("liver", "named.png"), numbered = render("5", "numbered.png");
  EXPECT_EQ(named.code, 0) << named.output;
  EXPECT_NE(named.output.find("'liver' is taken for 5, as TotalSegmentator 2 counts"), std::string::npos)
      << named.output;
  EXPECT_EQ(numbered.code, 0) << numbered.output;
  EXPECT_EQ(testing::contents_of(scratch / "named.png"), testing::contents_of(scratch / "numbered.png"));
  EXPECT_EQ(render("liver,portal_vein_and_splenic_vein", "both.png").code, 0);
  EXPECT_NE(testing::contents_of(scratch / "both.png"), testing::contents_of(scratch / "named.png"));
  const auto none = render("lever", "none.png");
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.output.find("labels.nii.gz: names none of its labels, and 'lever'"), std::string::npos) << none.output;
}

TEST(Commands, RegisterFiducialsOnThePelvisPhantom) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const Scratch scratch;
  const fs::path folder = *data / "fiducial_registration_pelvis_phantom";
  const std::string tracker = (folder / "Tracker_Fiducial_Markers.txt").string();
  for (const auto& [ct, fre, published] :
       {std::tuple{"pelvis_cropped_ct_fiducial_markers.txt", 0.4284, "Tracker_to_pelvis_cropped.txt"},
        std::tuple{"pelvis_nii_ct_fiducial_markers.txt", 0.6511, "Tracker_to_pelvis.txt"}}) {
    const auto result =
        run("birdseye", "register fiducials --ct " + (folder / ct).string() + " --tracker " + tracker + " --out " +
                            (scratch / "m.txt").string() + " --json " + (scratch / "m.json").string());
    ASSERT_EQ(result.code, 0) << result.output;
    const nlohmann::json json = read_json(scratch / "m.json");
    EXPECT_NEAR(json["fre_rms_mm"].get<double>(), fre, 5e-5);
    EXPECT_EQ(json["residuals_mm"].size(), 4U);
    EXPECT_EQ(json["leave_one_out_mm"].size(), 4U);
    EXPECT_EQ(json["verdict"], "pass");
    const auto written = host::read_pose(scratch / "m.txt");
    ASSERT_TRUE(written) << written.error().what;
    std::ifstream reference(folder / published);
    for (int i = 0; i < 16; ++i) {
      double expected = 0;
      reference >> expected;
      EXPECT_NEAR((*written)(i / 4, i % 4), expected, 1e-6);
      EXPECT_NEAR(
          json["patient_from_tracker"][static_cast<std::size_t>(i / 4)][static_cast<std::size_t>(i % 4)].get<double>(),
          expected, 1e-6);
    }
  }
}

TEST(Commands, RegisterFiducialsRefusesBadInputInOneLine) {
  const Scratch scratch;
  const std::string four = scratch.file("four.txt", kFour);
  const fs::path out = scratch / "out.txt";
  const auto refuse = [&](const std::string& ct, const std::string& tracker, const std::vector<std::string>& words) {
    expect_refused("birdseye", "register fiducials --ct " + ct + " --tracker " + tracker + " --out " + out.string(),
                   words, out);
  };
  const std::string two = scratch.file("two.txt", "0 0 0\n1 0 0\n");
  const std::string line = scratch.file("line.txt", "0 0 0\n1 1 1\n2 2 2\n3 3 3\n");
  refuse((scratch / "none.txt").string(), four, {"none.txt", "no such file"});
  refuse(two, two, {"two.txt", "at least three"});
  refuse(line, line, {"line.txt", "on a line"});
  refuse(four, two, {"four.txt", "same points"});
  refuse(scratch.file("word.txt", "0 0 0\n1 2 x\n"), four, {"word.txt", "line 2", "2 numbers"});
  refuse(scratch.file("short.txt", "0 0 0\n1 2\n"), four, {"short.txt", "line 2"});
}

TEST(Commands, WritesAllItsFilesOrNone) {
  const Scratch scratch;
  const std::string four = scratch.file("four.txt", kFour);
  const std::string common = "register fiducials --ct " + four + " --tracker " +
                             scratch.file("touched.txt", "7 0 1\n107 0 1\n7 80 1\n17 20 61\n") + " --out ";
  expect_refused("birdseye", common + (scratch / "m.txt").string() + " --json /nonexistent/r.json",
                 {"/nonexistent/r.json", "permissions"}, scratch / "m.txt");
  EXPECT_EQ(std::distance(fs::directory_iterator(scratch.path()), fs::directory_iterator()), 2)
      << "half of one is left";
  expect_refused("birdseye", common + scratch.path().string(), {scratch.path().string(), "is a folder"});
  // A pipe or a device takes the text and stays what it is.
  EXPECT_EQ(run("birdseye", common + "/dev/null --json " + (scratch / "r.json").string()).code, 0);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_TRUE(fs::exists(scratch / "r.json"));
}

TEST(Commands, AWrongOrderOfFiducialsFailsWithCode3) {
  const Scratch scratch;
  const auto result = run("birdseye", "register fiducials --ct " + scratch.file("a.txt", kFour) + " --tracker " +
                                          scratch.file("b.txt", "100 0 0\n0 0 0\n10 20 60\n0 80 0\n") + " --out " +
                                          (scratch / "o.txt").string());
  EXPECT_EQ(result.code, 3) << result.output;
}

TEST(Commands, BenchRenderWritesItsTable) {
  const Scratch scratch;
  const auto result = run("birdseye", "bench render --phantom liver --level 0 --level 2 --frames 3 --json " +
                                          (scratch / "b.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(scratch / "b.json");
  ASSERT_EQ(json["rows"].size(), 8U);  // two depths, two levels, with and without pruning
  for (const auto& row : json["rows"]) {
    EXPECT_EQ(row["viewport"], "768x576");
    EXPECT_GT(row["frame_ms_median"].get<double>(), 0);
    EXPECT_GT(row["cpu_ms_median"].get<double>(), 0);
    EXPECT_LT(row["mean_abs_error_255"].get<double>(), 0.5) << row;
    EXPECT_LT(row["memory_ratio"].get<double>(), 3) << row;
  }
  EXPECT_EQ(json["rows"][2]["free_vertices"], 27);
  EXPECT_EQ(json["verdict"], "pass") << json["reasons"];
}

TEST(Commands, BenchSimilarityAgreesWithOpenCv) {
  const Scratch scratch;
  const auto result = run("birdseye", "bench similarity --rounds 1 --json " + (scratch / "s.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(scratch / "s.json");
  ASSERT_EQ(json["rows"].size(), 7U);
  for (const auto& row : json["rows"]) {
    EXPECT_EQ(row["viewport"], "768x576");
    EXPECT_GT(row["value_ms_median"].get<double>(), 0);
  }
  EXPECT_EQ(json["rows"][1]["measure"], "mi");
  EXPECT_EQ(json["rows"][1]["bins"], 64);
  EXPECT_GT(json["rows"][1]["opencv_ratio"].get<double>(), 0);
  EXPECT_EQ(json["verdict"], "pass") << json["reasons"];
}

TEST(Commands, WrongUsageIsCode2) {
  for (const auto& [program, arguments] :
       {std::pair{"birdseye", ""}, {"birdseye", "volume info"}, {"birdseyed", ""}, {"birdseye-sim", "cart"}}) {
    expect_refused(program, arguments, {program, "--help"});
  }
  EXPECT_EQ(run("birdseye", "--help").code, 0);
}

TEST(Commands, BirdseyedRefusesWhatItCannotUseInOneLine) {
  const Scratch scratch;
  expect_refused("birdseyed", "--config " + (scratch / "none.toml").string(), {"none.toml"});
  const std::string camera = "[camera]\nsource = \"socket:/nonexistent\"\n";
  expect_refused("birdseyed",
                 "--config " + scratch.file("key.toml", "[tracker]\ndevice = \"/dev/null\"\nbirdz = 2\n" + camera),
                 {"key.toml:3", "birdz", "unknown key"});
}

TEST(Commands, BirdseyedProbesItsInstrumentsAndNamesEachThatItCannotUse) {
  const Scratch scratch;
  const std::string file = scratch.file(
      "cam.toml", "[tracker]\ndevice = \"/dev/null\"\n[camera]\nsource = \"socket:/nonexistent\"\n[wire]\nport = 0\n");
  const auto result = run("birdseyed", "--probe --config " + file);
  EXPECT_EQ(result.code, 2);
  for (const char* expected : {"/nonexistent", "[camera] source", "/dev/null"})
    EXPECT_NE(result.output.find(expected), std::string::npos) << result.output;
}

TEST(Commands, DemoLeavesFilesOfTheUsersOwn) {
  const Scratch scratch;
  const std::string out = scratch.path().string();
  for (const char* name : {"overlay.png", "ct.nii.gz"}) {
    const std::string own = scratch.file(name, "the user's own");
    expect_refused("birdseye", "demo --out " + out, {name, "not of an earlier demo", "give another --out"});
    expect_refused("birdseye", "demo --ct " + own + " --out " + out, {name, "is read", "give another --out"});
    EXPECT_EQ(testing::contents_of(own), "the user's own");
    fs::remove(own);
  }
  EXPECT_TRUE(fs::is_empty(scratch.path()));
}

TEST(Commands, WhatIsReadIsNotWrittenOver) {
  const Scratch scratch;
  fs::create_directory(scratch / "in");
  const std::string file = scratch.file("in/one.json", "{}"), folder = (scratch / "in").string();
  const std::string slice = scratch.file("in/one.dcm", "{}");
  const std::string other = (scratch / "in/../in/one.json").string(), here = (scratch / "./in/new.json").string();
  const std::vector<std::string> over{"would be written over"}, twice{"is written by", "too"};
  expect_refused("birdseye", "render --volume ct --pose " + file + " --movie " + other, over);
  expect_refused("birdseye", "live --language " + file + " --list-texts " + other, over);
  expect_refused("birdseye", "calibrate tip --poses " + folder + " --out " + slice, over);
  expect_refused("birdseye", "calibrate camera --board chessboard:14x10:3mm --images " + folder + " --out " + slice,
                 over);
  expect_refused("birdseye", "volume markers " + folder + " --near 1,2,3 --out " + slice, over);
  expect_refused("birdseye", "volume info " + folder + " --json " + slice, over);
  expect_refused("birdseye", "doctor --ct " + folder + " --json " + slice, over);
  expect_refused("birdseye",
                 "calibrate field check --plate p --measured m --history " + here + " --json " + folder + "/new.json",
                 twice);
  expect_refused("birdseye", "bench register --study " + here + " --json " + folder + "/new.json", twice);
  expect_refused("birdseye", "export --views " + folder + " --out " + (scratch / "o").string() + " --json " + file,
                 over);
  EXPECT_EQ(testing::contents_of(file), "{}");
  EXPECT_EQ(testing::contents_of(slice), "{}");
  EXPECT_FALSE(fs::exists(here));
  // A new file may go where its inputs lie, and two texts into one device.
  const std::string points = scratch.file("in/points.txt", kFour);
  const std::string good =
      "register fiducials --ct " + points + " --tracker " + scratch.file("t.txt", "7 0 1\n107 0 1\n7 80 1\n17 20 61\n");
  EXPECT_EQ(run("birdseye", good + " --out " + here + " --json /dev/null --report /dev/null").code, 0);
}

/// By a pattern, a camera's name behind a colon, a header that names files, or a case.
TEST(Commands, WhatIsReadWithoutItsNameBeingGivenIsNotWrittenOver) {
  const Scratch scratch;
  fs::create_directories(scratch / "in/o");
  const auto in = [&scratch](const std::string& name) { return (scratch / "in" / name).string(); };
  std::vector<std::string> kept;
  const auto keep = [&](const std::string& name) { kept.push_back(scratch.file("in/" + name, "the user's own")); };
  for (const char* name : {"1378.txt", "ct.raw", "ct002.raw", "a ct.raw", "slice1.raw", "ct.img", "CT2.IMG", "view.png",
                           "mask.png", "o/field.mha"})
    keep(name);
  const auto chain = scratch.file("in/chain.yaml", "cam0: {}\n");
  (void)scratch.file("in/ct.mhd", "NDims = 3\nElementDataFile = ct.raw\n");
  (void)scratch.file("in/blank.mhd", "NDims = 3\nElementDataFile = a ct.raw\n");
  (void)scratch.file("in/many.nhdr", "NRRD0004\ndata file: ct%03d.raw 1 2 1\n");
  (void)scratch.file("in/list.nhdr", "NRRD0004\ndata file: LIST\nslice0.raw\nslice1.raw\n");
  (void)scratch.file("in/ct.hdr", "");
  (void)scratch.file("in/CT2.HDR", "");
  (void)scratch.file("in/case.toml",
                     "[volume]\npath = \"ct.mhd\"\n[model]\ninitial = \"o/field.mha\"\n[[view]]\nimage = 'view.png'\n"
                     "camera = \"chain.yaml:cam0\"\nmask = \"./mask.png\"\n");
  const std::vector<std::string> over{"would be written over"};
  for (const char* option : {"--out", "--json", "--report"})
    expect_refused("birdseye", "calibrate tip --poses '" + in("13*.txt") + "' " + option + " " + in("1378.txt"), over);
  expect_refused(
      "birdseye",
      "calibrate camera --board chessboard:9x6:5mm --images '" + in("vie?.png") + "' --out " + in("view.png"), over);
  expect_refused("birdseye", "render --volume ct --pose p --camera " + chain + ":cam0 --out x.png --json " + chain,
                 over);
  for (const auto& [header, voxels] : {std::pair{"ct.mhd", "ct.raw"},
                                       {"blank.mhd", "a ct.raw"},
                                       {"many.nhdr", "ct002.raw"},
                                       {"list.nhdr", "slice1.raw"},
                                       {"ct.hdr", "ct.img"},
                                       {"CT2.HDR", "CT2.IMG"}})
    expect_refused("birdseye", "volume info " + in(header) + " --json '" + in(voxels) + "'", over);
  const std::string views = "register views --case " + in("case.toml") + " --out ";
  for (const char* name : {"view.png", "mask.png", "ct.raw", "chain.yaml", "ct.mhd"})
    expect_refused("birdseye", views + (scratch / "o").string() + " --json " + in(name), over, scratch / "o");
  expect_refused("birdseye", views + in("o"), {"o/field.mha: is read, and would be written over", "another --out"});
  for (const std::string& file : kept) EXPECT_EQ(testing::contents_of(file), "the user's own") << file;
  EXPECT_EQ(testing::contents_of(chain), "cam0: {}\n");
  // What no header names, and no pattern matches, is the user's to have written anew.
  for (const char* name : {"slice2.raw", "figures.json"}) {
    (void)scratch.file(std::string("in/") + name, "an earlier run's");
    for (const std::string& command :
         {"volume info " + in("list.nhdr"), "calibrate tip --poses '" + in("13*.txt") + "'"}) {
      const auto result = run("birdseye", command + " --json " + in(name));
      EXPECT_EQ(result.output.find("would be written over"), std::string::npos) << result.output;
    }
  }
}

/// An encoder that takes nothing for longer than is recorded, and an appliance that stands still though it is
/// connected.
constexpr const char* kSlowAndShort = R"sh(mkdir slow
printf '#!/bin/sh\nsleep 4.5\nexec %s "$@"\n' $(command -v ffmpeg) > slow/ffmpeg; chmod +x slow/ffmpeg
record="$bin/birdseye record --server $server"
PATH=$PWD/slow:$PATH $record --out late --seconds 4 --video compressed --json late.json; echo "late $?"
$record --out short --seconds 6 --json short.json > short.log 2>&1 &
short=$!
for n in $(seq 150); do [ $(cat short/events.jsonl 2>/dev/null | wc -l) -gt 50 ] && break; sleep 0.1; done
kill -STOP $appliance
wait $short; echo "short $?"
kill -CONT $appliance
cat short.log
)sh";

TEST(Commands, ARecordingHoldsWhatCameBeforeItsEndAndSaysWhereThatIsTooLittle) {
  const Scratch scratch;
  const auto found = testing::run_at_cart(scratch, {}, kSlowAndShort);
  for (const char* line : {"late 0", "short 0", "of the 6 s that were asked for are in it"})
    EXPECT_NE(found.output.find(line), std::string::npos) << line << "\n" << found.output;
  const nlohmann::json late = read_json(scratch / "late.json"), shorter = read_json(scratch / "short.json");
  EXPECT_GT(late["frames"], 50) << found.output;
  EXPECT_GT(late["measurements"], 200);
  EXPECT_LE(late["seconds"], 4) << "what came later is no part of it";
  EXPECT_EQ(found.output.find("of the 4 s that were asked for"), std::string::npos) << found.output;
  EXPECT_EQ(read_json(scratch / "late/recording.json")["frames"], late["frames"]);
  EXPECT_EQ(shorter["verdict"], "marginal");
  EXPECT_LT(shorter["seconds"], 5.4);
}

/// What a command wrote into a folder that it reads, and no reader takes, is written anew by the next run.
TEST(Commands, FiguresBesideWhatIsReadAreWrittenAgain) {
  const Scratch scratch;
  fs::create_directory(scratch / "in");
  const std::string folder = (scratch / "in").string(), figures = scratch.file("in/x.json", "{}");
  const auto result = run("birdseye", "volume info " + folder + " --json " + figures);
  EXPECT_EQ(result.output.find("would be written over"), std::string::npos) << result.output;
}

TEST(Commands, DemoLeavesFoldersOfTheUsersOwn) {
  const Scratch scratch;
  const std::string out = scratch.path().string();
  for (const char* name : {"phantom", "truth"}) {
    fs::create_directory(scratch / name);
    const std::string own = scratch.file(std::string(name) + "/own.txt", "the user's own");
    for (const char* sheet : {"", R"({"verdict": "pass"})"}) {
      (void)scratch.file("report.json", sheet);
      expect_refused("birdseye", "demo --out " + out, {"report.json", "not of an earlier demo", "give another --out"});
    }
    fs::remove(scratch / "report.json");
    expect_refused("birdseye", "demo --out " + out, {name, "not of an earlier demo", "give another --out"});
    (void)scratch.file("report.json", R"({"verdict": "fail", "did_not_end": true})");
    expect_refused("birdseye", "demo --ct " + (scratch / name).string() + " --out " + out,
                   {name, "is read", "give another --out"});
    EXPECT_EQ(testing::contents_of(own), "the user's own");
    fs::remove(scratch / "report.json");
    fs::remove_all(scratch / name);
  }
}

TEST(Commands, AStudyLeavesFilesOfTheUsersOwn) {
  const Scratch scratch;
  for (const char* name : {"study.json", "sweeps.svg", "cost-curves.svg"}) {
    const std::string own = scratch.file(name, "the user's own");
    expect_refused("birdseye", "bench register --quick --sweep noise --study " + scratch.path().string(),
                   {name, "not of an earlier bench register --study", "give another --study"});
    EXPECT_EQ(testing::contents_of(own), "the user's own");
    fs::remove(own);
    EXPECT_TRUE(fs::is_empty(scratch.path()));
  }
}

TEST(Commands, DemoRefusesACtThatIsNotThere) {
  const Scratch scratch;
  expect_refused("birdseye", "demo --ct /nonexistent.nii --out " + (scratch / "o").string(), {"/nonexistent.nii"},
                 scratch / "o/report.json");
}

}  // namespace
}  // namespace birdseye
