#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "host/deform/displacement_field.hpp"
#include "tests/support/command.hpp"
#include "tests/support/data.hpp"
#include "tests/support/display.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"

namespace birdseye {
namespace {

namespace fs = std::filesystem;
using host::DisplacementField;
using testing::contents_of;
using testing::Display;
using testing::expect_refused;
using testing::read_json;
using testing::run;
using testing::Scratch;
using testing::small_ct;

constexpr const char* kIdentity = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
constexpr const char* kCamera =
    "%YAML:1.0\n---\nimage_width: 64\nimage_height: 48\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: "
    "d\n"
    "   data: [ 60., 0., 32., 0., 60., 24., 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 1\n   "
    "cols: 5\n"
    "   dt: d\n   data: [ -0.1, 0., 0., 0., 0. ]\n";

/// A push over small_ct's ball to the patient's right, or with a large one tissue through itself.
std::string push(const Scratch& scratch, float right_mm) {
  DisplacementField field;
  field.size = {5, 5, 5};
  field.patient_from_lattice.linear() = 10 * Eigen::Matrix3d::Identity();
  field.patient_from_lattice.translation() = Eigen::Vector3d(-20, -20, -20);
  field.displacement_mm.assign(125, Eigen::Vector3f::Zero());
  field.displacement_mm[62].x() = right_mm;
  const fs::path path = scratch / ("push" + std::to_string(right_mm) + ".mha");
  EXPECT_TRUE(host::write_field(path, field));
  return path.string();
}

/// A frame of video, red from left to right.
std::string video_frame(const Scratch& scratch, int width_px, int height_px) {
  std::string text = "P6\n" + std::to_string(width_px) + " " + std::to_string(height_px) + "\n255\n";
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) text += {static_cast<char>(255 * x / width_px), '\x20', '\x40'};
  }
  return scratch.file("video.ppm", text);
}

TEST(RenderCommand, AWindowShowsWhatAPictureHolds) {
  const Scratch scratch;
  const Display display;
  const std::string common = "render --volume " + small_ct(scratch) +
                             " --clip 0 --size 120x90 --transfer skin --over " + video_frame(scratch, 120, 90) +
                             " --deformation " + push(scratch, 6);
  for (const std::string engine : {"cpu", "gl", "slices"}) {
    const fs::path picture = scratch / (engine + ".png"), window = scratch / (engine + "_window.png");
    const auto drawn = run("birdseye", common + " --engine " + engine + " --out " + picture.string());
    ASSERT_EQ(drawn.code, 0) << drawn.output;
    const auto shown = run("birdseye", common + " --engine " + engine + " --window --frames 3 --out " + window.string(),
                           display.env());
    ASSERT_EQ(shown.code, 0) << shown.output;
    EXPECT_EQ(shown.output, "");
    EXPECT_GT(contents_of(picture).size(), 1000U);
    EXPECT_EQ(contents_of(window), contents_of(picture)) << engine;
  }
}

TEST(RenderCommand, AWindowSaysWhatItLacks) {
  const Scratch scratch;
  const Display display;
  const std::string common = "render --volume " + small_ct(scratch) + " --size 64x48";
  const fs::path out = scratch / "o.png";
  const std::string window = common + " --window --frames 1 --out " + out.string();
  expect_refused("birdseye", window, {"display", "--out instead of --window"}, out,
                 "env -u DISPLAY -u WAYLAND_DISPLAY");
  expect_refused("birdseye", window, {"display", "--out instead of --window"}, out, "env DISPLAY=:4242");
  expect_refused("birdseye", window, {"OpenGL 4.5", "libgl1-mesa-dri", "--out instead of --window"}, out,
                 display.env() + " MESA_GL_VERSION_OVERRIDE=3.3");
  expect_refused("birdseye", common, {"--out", "--window"});
  expect_refused("birdseye", common + " --frames 2 --out " + out.string(), {"--window"}, out);
  expect_refused("birdseye", common + " --over " + video_frame(scratch, 64, 40) + " --out " + out.string(),
                 {"video.ppm", "64x40", "64x48"}, out);
  expect_refused("birdseye", common + " --over " + scratch.file("no.png", "no") + " --out " + out.string(),
                 {"no.png", "no picture"}, out);
}

/// Ways in which OpenGL can lack: no library, no vendor in it, no driver for the vendor, too old a driver.
std::vector<std::pair<std::string, std::string>> absences(const Scratch& scratch) {
  fs::create_directory(scratch / "lib");
  const std::string broken = scratch.file("lib/libEGL.so.1", "no library");
  return {{"env LD_LIBRARY_PATH=" + fs::path(broken).parent_path().string(), "no libEGL.so.1"},
          {"env __EGL_VENDOR_LIBRARY_FILENAMES=/nonexistent", "no EGL with a surfaceless platform"},
          {"env LIBGL_DRIVERS_PATH=/nonexistent", "EGL finds no driver"},
          {"env MESA_GL_VERSION_OVERRIDE=3.3", "the driver has no OpenGL 4.5 core"}};
}

TEST(RenderCommand, WithoutADriverAutoTakesTheCpuAndSaysSo) {
  const Scratch scratch;
  const std::string common = "render --volume " + small_ct(scratch) + " --size 64x48 --out ";
  ASSERT_EQ(run("birdseye", common + (scratch / "cpu.png").string() + " --engine cpu").code, 0);
  for (const auto& [absence, missing] : absences(scratch)) {
    const auto result = run("birdseye", common + (scratch / "auto.png").string() + " --engine auto", absence);
    ASSERT_EQ(result.code, 0) << result.output;
    EXPECT_EQ(std::count(result.output.begin(), result.output.end(), '\n'), 2) << result.output;  // and what it drew
    EXPECT_NE(result.output.find("engine cpu: OpenGL: " + missing), std::string::npos) << result.output;
    EXPECT_EQ(contents_of(scratch / "auto.png"), contents_of(scratch / "cpu.png"));
  }
}

TEST(RenderCommand, WithoutADriverTheCardsEnginesSayWhatIsMissing) {
  const Scratch scratch;
  const fs::path out = scratch / "o.png";
  const std::string common = "render --volume " + small_ct(scratch) + " --size 64x48 --out " + out.string();
  for (const auto& [absence, missing] : absences(scratch)) {
    for (const std::string engine : {" --engine gl", " --engine slices"}) {
      expect_refused("birdseye", common + engine, {missing, "install libegl1 and libgl1-mesa-dri", "--engine cpu"}, out,
                     absence);
    }
  }
}

TEST(RenderCommand, RefusesAVolumeThatDoesNotFitIntoMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need more address space than the limit leaves";
#endif
  const Scratch scratch;
  const fs::path out = scratch / "o.png";
  const std::string header =
      scratch.file("large.nhdr",
                   "NRRD0004\ntype: short\ndimension: 3\nspace: left-posterior-superior\nsizes: 3000 3000 1000\n"
                   "space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nkinds: domain domain domain\n"
                   "endian: little\nencoding: raw\ndata file: large.raw\n");
  std::ofstream(scratch / "large.raw");
  fs::resize_file(scratch / "large.raw", 18'000'000'000);  // holes: it takes no room
  for (const std::string engine : {"cpu", "gl", "slices", "auto"}) {
    expect_refused("birdseye", "render --volume " + header + " --engine " + engine + " --out " + out.string(),
                   {"large.nhdr", "more memory than there is", "resample it"}, out, "ulimit -v 8000000;");
  }
}

TEST(RenderCommand, RefusesFieldsThatAreNoneInOneLine) {
  const Scratch scratch;
  const fs::path out = scratch / "o.png";
  const std::string ct = small_ct(scratch);
  const auto refuse = [&](const std::string& field, const std::vector<std::string>& words) {
    for (const std::string engine : {"cpu", "gl", "slices"}) {
      expect_refused(
          "birdseye",
          "render --volume " + ct + " --deformation " + field + " --engine " + engine + " --out " + out.string(), words,
          out);
    }
  };
  const std::string labels = (scratch / "labels.nii.gz").string();
  ASSERT_EQ(run("birdseye", "volume segment " + ct + " --hu 100,300 --out " + labels).code, 0);
  refuse(push(scratch, 25), {"push25", "folds", "smooth it or lessen it"});
  refuse(push(scratch, NAN), {"pushnan", "not finite"});
  refuse(labels, {"labels.nii.gz", "displacement field"});
  refuse((scratch / "none.mha").string(), {"none.mha", "no such file"});
  // Flat: no grid that can be trilinear in.
  DisplacementField flat;
  flat.size = {5, 5, 1};
  flat.displacement_mm.assign(25, Eigen::Vector3f::Zero());
  ASSERT_TRUE(host::write_field(scratch / "flat.mha", flat));
  refuse((scratch / "flat.mha").string(), {"flat.mha", "give the whole stack"});
}

TEST(RenderCommand, DrawsThroughALens) {
  const Scratch scratch;
  const std::string ct = small_ct(scratch);
  const std::string pose = scratch.file("pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 80\n0 0 0 1\n");
  const auto with_lens =
      run("birdseye", "render --volume " + ct + " --camera " + scratch.file("c.yaml", kCamera) + " --pose " + pose +
                          " --transfer skin --out " + (scratch / "lens.png").string() + " --json " +
                          (scratch / "r.json").string());
  ASSERT_EQ(with_lens.code, 0) << with_lens.output;
  // A ball of 12 mm seen from 80 mm with 60 px focal length: a disc of about 9 px radius in 64 x 48.
  const nlohmann::json json = read_json(scratch / "r.json");
  EXPECT_NEAR(json["coverage"].get<double>(), 3.1416 * 9.2 * 9.2 / (64 * 48), 0.025);
  const auto front =
      run("birdseye", "render --volume " + ct + " --size 80x60 --out " + (scratch / "front.png").string());
  EXPECT_EQ(front.code, 0) << front.output;
  EXPECT_GT(fs::file_size(scratch / "front.png"), 200U);
}

TEST(RenderCommand, FilmsAndRestrictsToLabels) {
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
                 {"l.nii.gz", "hold no voxel of 9"}, scratch / "n.png");
}

/// All frames of a film, or a picture, as raw RGB.
std::string rgb_of(const fs::path& path) {
  const std::string raw = path.string() + ".rgb";
  const std::string line = "ffmpeg -v error -y -i " + path.string() + " -f rawvideo -pix_fmt rgb24 " + raw;
  EXPECT_EQ(std::system(line.c_str()), 0) << line;
  return contents_of(raw);
}

double mean_difference(const std::string& a, const std::string& b) {
  EXPECT_EQ(a.size(), b.size());
  double sum = 0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    sum += std::abs(static_cast<std::uint8_t>(a[i]) - static_cast<std::uint8_t>(b[i]));
  }
  return sum / static_cast<double>(a.size());
}

TEST(RenderCommand, FilmsACameraOnItsWayFromTheFirstPoseToTheLast) {
  const Scratch scratch;
  const std::string common = "render --volume " + small_ct(scratch) + " --camera " + scratch.file("c.yaml", kCamera) +
                             " --transfer skin --over " + video_frame(scratch, 64, 48) + " --out ";
  const std::string first = "1 0 0 -8\n0 1 0 0\n0 0 1 80\n0 0 0 1\n", middle = "1 0 0 0\n0 1 0 4\n0 0 1 70\n0 0 0 1\n",
                    last = "0 1 0 10\n-1 0 0 0\n0 0 1 50\n0 0 0 1\n";
  fs::create_directory(scratch / "poses");
  const std::string pose_a = scratch.file("poses/a.txt", first), pose_b = scratch.file("poses/b.txt", middle),
                    pose_c = scratch.file("poses/c.txt", last);
  // The same poses one a line, as the simulator writes them.
  std::string table = "sequence,world_s,camera_from_patient_00\n";
  for (std::string pose : {first, middle, last}) {
    std::replace(pose.begin(), pose.end(), '\n', ' ');
    table += "7 0.25 " + pose + "\n";
  }
  const std::string still_a = (scratch / "a.png").string(), still_c = (scratch / "c.png").string();
  ASSERT_EQ(run("birdseye", common + still_a + " --pose " + pose_a).code, 0);
  ASSERT_EQ(run("birdseye", common + still_c + " --pose " + pose_c).code, 0);
  const std::string a = rgb_of(still_a), c = rgb_of(still_c);
  for (const std::string& path : {(scratch / "poses").string(), scratch.file("frames.csv", table)}) {
    const fs::path film = path + ".mp4";
    const auto filmed = run("birdseye", common + (scratch / "s.png").string() + " --path " + path + " --movie " +
                                            film.string() + " --seconds 1");
    ASSERT_EQ(filmed.code, 0) << filmed.output;
    EXPECT_EQ(rgb_of(scratch / "s.png"), a);
    const std::string frames = rgb_of(film);
    ASSERT_EQ(frames.size(), 25 * a.size());
    // Compression blurs a frame by a few parts of 255; that it is the still, its neighbours being less so, tells.
    const auto nearest = [&](const std::string& still) {
      std::vector<double> differences;
      for (std::size_t at = 0; at < frames.size(); at += still.size()) {
        differences.push_back(mean_difference(frames.substr(at, still.size()), still));
      }
      const auto least = std::min_element(differences.begin(), differences.end());
      EXPECT_LT(*least, 5);
      return least - differences.begin();
    };
    EXPECT_EQ(nearest(a), 0);
    EXPECT_EQ(nearest(c), 24);
  }
  EXPECT_GT(mean_difference(a, c), 20);
}

TEST(RenderCommand, RefusesAPathThatIsNone) {
  const Scratch scratch;
  const std::string common = "render --volume " + small_ct(scratch) + " --camera " + scratch.file("c.yaml", kCamera) +
                             " --out " + (scratch / "o.png").string() + " --movie " + (scratch / "o.mp4").string();
  const std::string one = "1 0 0 0 0 1 0 0 0 0 1 80 0 0 0 1\n";
  const auto refuse = [&](const std::string& path, const std::vector<std::string>& words) {
    expect_refused("birdseye", common + " --path " + path, words, scratch / "o.mp4");
  };
  refuse((scratch / "none.csv").string(), {"none.csv", "no such file"});
  refuse(scratch.file("one.csv", one), {"one.csv", "1 poses", "two"});
  refuse(scratch.file("short.csv", one + "1 0 0 0\n"), {"short.csv", "line 2", "4 numbers"});
  refuse(scratch.file("skew.csv", one + "1 1 0 0 0 1 0 0 0 0 1 80 0 0 0 1\n"), {"skew.csv", "line 2", "no rigid"});
  refuse(scratch.file("word.csv", "a,b\n" + one + "c,d\n"), {"word.csv", "line 3", "\"c\""});
  fs::create_directory(scratch / "empty");
  refuse((scratch / "empty").string(), {"empty", "0 poses"});
  const std::string two = scratch.file("two.csv", one + one);
  refuse(two + " --pose " + scratch.file("p.txt", kIdentity), {"--path", "--pose"});
  expect_refused("birdseye", "render --volume " + small_ct(scratch) + " --path " + two + " --out o.png", {"--movie"});
}

TEST(RenderCommand, ShowsTheRealAbdomen) {
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
    const nlohmann::json json = read_json(scratch / "a.json");
    EXPECT_GT(json["coverage"].get<double>(), least) << name;
    EXPECT_LT(json["coverage"].get<double>(), most) << name;
  }
}

TEST(RenderCommand, RefusesBadInputInOneLine) {
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
  const auto transfer = [&](const std::string& name, const std::string& points) {
    return "--transfer " + scratch.file(name, R"({"points": [)" + points + "]}");
  };
  const std::string at_100 = R"({"hu": 100, "rgb": [1, 1, 1], "extinction_per_mm": 1})";
  const std::string at_50 = R"({"hu": 50, "rgb": [1, 1, 1], "extinction_per_mm": 1})";
  refuse(transfer("falls.json", at_100 + "," + at_50), {"falls.json", "ascend in hu"});
  refuse(transfer("twice.json", at_100 + "," + at_100), {"twice.json", "ascend in hu"});
  refuse(transfer("none.json", ""), {"none.json", "no points"});
  refuse(transfer("dark.json", R"({"hu": 1, "rgb": [1, 1, 1], "extinction_per_mm": -1})"), {"dark.json", "negative"});
  refuse(transfer("loud.json", R"({"hu": 1, "rgb": [1, 2, 1], "extinction_per_mm": 1})"), {"loud.json", "[0, 1]"});
  refuse("--transfer " + scratch.file("text.json", "skin"), {"text.json", "JSON"});
  refuse("--transfer livre", {"livre", "liver"});
  refuse("--size big", {"--size"});
}

}  // namespace
}  // namespace birdseye
