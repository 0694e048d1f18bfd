#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "hw-sim/phantom/dicom_series.hpp"
#include "hw-sim/phantom/grid.hpp"
#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using testing::run;
using testing::Scratch;

constexpr const char* kFour = "0 0 0\n100 0 0\n0 80 0\n10 20 60\n";
constexpr const char* kIdentity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
constexpr const char* kCamera =
    "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: "
    "d\n"
    "   data: [ 60., 0., 32., 0., 60., 24., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   "
    "cols: 5\n"
    "   dt: d\n   data: [ -0.1, 0., 0., 0., 0. ]\n";

/// A small CT with a bright ball in it.
std::string small_ct(const Scratch& scratch) {
  hw_sim::Grid grid;
  grid.size = {20, 20, 20};
  grid.spacing_mm = {2, 2, 2};
  grid.origin_mm = {-20, -20, -20};
  std::vector<std::int16_t> hu;
  for (int k = 0; k < 20; ++k) {
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 20; ++i) hu.push_back(grid.point(i, j, k).norm() < 12 ? 200 : -1000);
    }
  }
  EXPECT_TRUE(hw_sim::write_dicom_series(scratch / "ct", grid, hu, 1));
  return (scratch / "ct").string();
}

/// Exit code 2, one line on standard error that says what and names where, and no file left behind.
void expect_refused(const std::string& program, const std::string& arguments, const std::vector<std::string>& words,
                    const fs::path& not_written = {}) {
  const auto result = run(program, arguments);
  EXPECT_EQ(result.code, 2) << arguments << "\n" << result.output;
  EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 1) << result.output;
  EXPECT_EQ(result.output.find(program + ": "), 0U) << result.output;
  for (const std::string& word : words)
    EXPECT_NE(result.output.find(word), std::string::npos) << word << "\n" << result.output;
  if (!not_written.empty()) {
    EXPECT_FALSE(fs::exists(not_written)) << not_written;
  }
}

TEST(Commands, VolumeInfoWritesItsFigures) {
  const Scratch scratch;
  const std::string json_path = (scratch / "info.json").string();
  const auto result = run("birdseye", "volume info " + small_ct(scratch) + " --json " + json_path);
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(json_path));
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
    const nlohmann::json json = nlohmann::json::parse(std::ifstream(scratch / "m.json"));
    EXPECT_NEAR(json["fre_rms_mm"].get<double>(), fre, 5e-5);
    EXPECT_EQ(json["residuals_mm"].size(), 4U);
    EXPECT_EQ(json["leave_one_out_mm"].size(), 4U);
    EXPECT_EQ(json["verdict"], "pass");
    std::ifstream reference(folder / published), written(scratch / "m.txt");
    for (int i = 0; i < 16; ++i) {
      double expected = 0, got = 0;
      reference >> expected;
      written >> got;
      EXPECT_NEAR(got, expected, 1e-6);
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
  refuse(scratch.file("word.txt", "0 0 0\n1 2 x\n"), four, {"word.txt", "line 2", "\"x\""});
  refuse(scratch.file("short.txt", "0 0 0\n1 2\n"), four, {"short.txt", "line 2"});
}

TEST(Commands, WritesAllItsFilesOrNone) {
  const Scratch scratch;
  const std::string four = scratch.file("four.txt", kFour);
  const std::string common = "register fiducials --ct " + four + " --tracker " + four + " --out ";
  expect_refused("birdseye", common + (scratch / "m.txt").string() + " --json /nonexistent/r.json",
                 {"/nonexistent/r.json", "permissions"}, scratch / "m.txt");
  EXPECT_FALSE(fs::exists(scratch / "m.txt.part"));
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

TEST(Commands, RenderDrawsThroughALens) {
  const Scratch scratch;
  const std::string ct = small_ct(scratch);
  const std::string pose = scratch.file("pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 80\n0 0 0 1\n");
  const auto with_lens =
      run("birdseye", "render --volume " + ct + " --camera " + scratch.file("c.yaml", kCamera) + " --pose " + pose +
                          " --transfer skin --out " + (scratch / "lens.png").string() + " --json " +
                          (scratch / "r.json").string());
  ASSERT_EQ(with_lens.code, 0) << with_lens.output;
  // A ball of 12 mm seen from 80 mm with 60 px focal length: a disc of about 9 px radius in 64 x 48.
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(scratch / "r.json"));
  EXPECT_NEAR(json["coverage"].get<double>(), 3.1416 * 9.2 * 9.2 / (64 * 48), 0.025);
  const auto front =
      run("birdseye", "render --volume " + ct + " --size 80x60 --out " + (scratch / "front.png").string());
  EXPECT_EQ(front.code, 0) << front.output;
  EXPECT_GT(fs::file_size(scratch / "front.png"), 200U);
}

TEST(Commands, BenchRenderWritesItsTable) {
  const Scratch scratch;
  const auto result = run("birdseye", "bench render --phantom liver --level 0 --level 2 --frames 3 --json " +
                                          (scratch / "b.json").string());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(scratch / "b.json"));
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

TEST(Commands, RenderFilmsAndRestrictsToLabels) {
  const Scratch scratch;
  const std::string ct = small_ct(scratch);
  const std::string labels = (scratch / "l.nii.gz").string();
  ASSERT_EQ(run("birdseye", "volume segment " + ct + " --hu 100,300 --out " + labels).code, 0);
  const auto kept =
      run("birdseye", "render --volume " + ct + " --labels " + labels + " --keep 1 --clip 0 --size 64x48 --out " +
                          (scratch / "k.png").string() + " --movie " + (scratch / "k.mp4").string());
  EXPECT_EQ(kept.code, 0) << kept.output;
  EXPECT_GT(fs::file_size(scratch / "k.mp4"), 1000U);
  expect_refused("birdseye",
                 "render --volume " + ct + " --labels " + labels + " --keep 9 --out " + (scratch / "n.png").string(),
                 {"l.nii.gz", "none of 9"}, scratch / "n.png");
}

TEST(Commands, RenderShowsTheRealAbdomen) {
  const auto data = testing::data_dir();
  if (!data) GTEST_SKIP() << "no recordings: set BIRDSEYE_DATA to the folder of real data";
  const Scratch scratch;
  // The body fills most of the frontal view, and of the slab seen from the feet about a third.
  for (const auto& [name, least, most] :
       {std::tuple{"example_ct.nii.gz", 0.5, 0.95}, std::tuple{"example_ct_dicom", 0.2, 0.5}}) {
    const auto result =
        run("birdseye", "render --volume " + (*data / "ct_abdomen" / name).string() + " --size 300x300 --out " +
                            (scratch / "a.png").string() + " --json " + (scratch / "a.json").string());
    ASSERT_EQ(result.code, 0) << result.output;
    const nlohmann::json json = nlohmann::json::parse(std::ifstream(scratch / "a.json"));
    EXPECT_GT(json["coverage"].get<double>(), least) << name;
    EXPECT_LT(json["coverage"].get<double>(), most) << name;
  }
}

TEST(Commands, RenderRefusesBadInputInOneLine) {
  const Scratch scratch;
  const std::string ct = small_ct(scratch);
  const fs::path out = scratch / "out.png";
  const auto refuse = [&](const std::string& arguments, const std::vector<std::string>& words) {
    expect_refused("birdseye", "render --volume " + ct + " --out " + out.string() + " " + arguments, words, out);
  };
  const std::string camera = scratch.file("camera.yaml", kCamera);
  const std::string pose = scratch.file("pose.txt", kIdentity);
  const std::string no_size = std::string(kCamera).erase(14, std::string("image_width: 64\n").size());
  refuse("--camera " + scratch.file("size.yaml", no_size) + " --pose " + pose, {"size.yaml", "image_width"});
  refuse("--camera " + camera + " --pose " + scratch.file("row.txt", "1 0 0 0\n0 1 0 0\n0 0 0 1\n"),
         {"row.txt", "3 rows"});
  refuse("--camera " + camera + " --pose " + scratch.file("shear.txt", "1 1 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"),
         {"shear.txt", "no rigid"});
  refuse("--camera " + camera, {"--pose"});
  std::string skew = kCamera;
  skew.replace(skew.find("60., 0."), 7, "60., 1.");
  refuse("--camera " + scratch.file("skew.yaml", skew) + " --pose " + pose, {"skew.yaml", "skew"});
  refuse("--transfer " + scratch.file("t.json", R"({"points": [{"hu": 1, "rgb": [1, 1, 1], "extinction": 2}]})"),
         {"t.json", "extinction: unknown key"});
  refuse("--transfer livre", {"livre", "liver"});
  refuse("--size big", {"--size"});
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
  expect_refused("birdseyed", "--config " + scratch.file("key.toml", "[tracker]\ndevice = \"/dev/null\"\nbirdz = 2\n"),
                 {"key.toml", "birdz", "unknown key"});
  expect_refused(
      "birdseyed",
      "--config " +
          scratch.file(
              "cam.toml",
              "[tracker]\ndevice = \"/dev/null\"\n[camera]\nsource = \"socket:/nonexistent\"\n[wire]\nport = 0\n"),
      {"/nonexistent", "[camera] source"});
}

TEST(Commands, DemoRefusesACtThatIsNotThere) {
  const Scratch scratch;
  expect_refused("birdseye", "demo --ct /nonexistent.nii --out " + (scratch / "o").string(), {"/nonexistent.nii"},
                 scratch / "o/report.json");
}

}  // namespace
}  // namespace birdseye
