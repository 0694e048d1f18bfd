// `birdseye live` over the simulated cart, from the first connection to the registered overlay, by a script alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/child.hpp"
#include "tests/support/command.hpp"
#include "tests/support/display.hpp"
#include "tests/support/json_file.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::read_json;
using testing::run;
using testing::Scratch;

TEST(Live, ReachesARegisteredOverlayByAScriptAlone) {
  const Scratch scratch;
  const testing::Display display("1280x720");
  const std::string out = (scratch / "live").string();
  // On a machine that is too slow at one moment there is rightly no overlay then: no view is kept, no snapshot bears
  // one.
  std::string several;
  for (int i = 0; i < 6; ++i) several += "wait overlay 60\nkey s\nsleep 0.7\n";
  const std::string script =
      scratch.file("script.txt", "wait connect 90\nwait calibrate 120\nshot " + out + "/calibrated.png\n" +
                                     "wait fiducials 60\nshot " + out + "/registered.png\n" +
                                     "press space 1.4 views 60\nkey enter\nkey space\nwait deform 180\nshot " + out +
                                     "/deformed.png\nkey enter\nkey space\nwait run 2\nsleep 6\n" + several + "end\n");
  const auto result =
      run("birdseye",
          "live --simulate --seed 3 --deformation-mm 10 --look-s 240 --margins 5,10 --outlines --hole 0.4 --out " +
              out + " --script " + script + " --json " + (scratch / "live.json").string(),
          display.env());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = read_json(scratch / "live.json");
  EXPECT_NE(json["verdict"], "fail") << json;
  // The liver has moved by 10 mm since the CT, the tumour in it by 7 mm; five views of one side of it bring the tumour
  // most of the way back.
  const auto before_mm = json["target_error_before_deforming_mm_p50"].get<double>();
  EXPECT_NEAR(before_mm, 7.5, 1.5);
  EXPECT_LE(json["target_error_mm_p50"].get<double>(), 0.5 * before_mm) << json;
  EXPECT_LE(json["target_error_mm_p95"].get<double>(), 5.0) << json;
  EXPECT_LE(json["target_error_mm_p50"].get<double>(), 1.6 * json["expected_error_mm_p50"].get<double>()) << json;
  EXPECT_GT(json["frames_overlaid"].get<int>(), 0);
  for (const char* name : {"calibrated.png", "registered.png", "deformed.png", "snapshot-001.png"}) {
    const cv::Mat picture = cv::imread(out + "/" + name);
    EXPECT_EQ(picture.cols, 1280) << name;
    EXPECT_EQ(picture.rows, 720) << name;
  }
  // The snapshot says by what it was drawn: that draws it again, to the bit.
  std::string folder;
  nlohmann::json sheet;
  for (int i = 1; i <= 6 && folder.empty(); ++i) {
    const std::string one = out + "/snapshot-00" + std::to_string(i);
    sheet = read_json(one + "/snapshot.json");
    if (sheet["overlaid"].get<bool>()) folder = one;
  }
  ASSERT_FALSE(folder.empty()) << "none of six snapshots bears an overlay: " << sheet;
  std::string arguments;
  for (const auto& argument : sheet["drawn_again_by"]) arguments.append("'").append(argument).append("' ");
  const auto again = run("birdseye", arguments + "--out " + (scratch / "again.png").string());
  ASSERT_EQ(again.code, 0) << again.output;
  const cv::Mat shown = cv::imread(folder + "/picture.png"), drawn = cv::imread(scratch / "again.png");
  const cv::Mat video = cv::imread(folder + "/video.png");
  ASSERT_EQ(shown.size(), drawn.size());
  EXPECT_EQ(cv::norm(shown, drawn, cv::NORM_INF), 0);
  EXPECT_GT(cv::norm(shown, video, cv::NORM_INF), 20) << "nothing was drawn";
}

TEST(Live, WithoutASourceAPageOffersTheSimulatedCart) {
  const Scratch scratch;
  const testing::Display display("1280x720");
  const auto shot = [&](const char* name) { return (scratch / name).string(); };
  const std::string closing = scratch.file("closing.txt", "shot " + shot("page.png") + "\nkey q\n");
  testing::expect_refused("birdseye", "live --script " + closing, {"--recording PATH"}, "", display.env());
  const cv::Mat page = cv::imread(shot("page.png"));
  ASSERT_EQ(page.size(), cv::Size(1280, 720));
  // The buttons are in view, whose colour nothing else on the page has.
  cv::Mat blue;
  cv::inRange(page, cv::Scalar(100, 60, 30), cv::Scalar(140, 90, 55), blue);
  EXPECT_GT(cv::countNonZero(blue), 10'000);

  const std::string starting =
      scratch.file("starting.txt", "key space\nwait connect 90\nshot " + shot("cart.png") + "\nend\n");
  const auto started =
      run("birdseye", "live --script " + starting + " --out " + (scratch / "out").string(), display.env());
  EXPECT_EQ(started.code, 3) << started.output;  // for no overlay was reached yet
  EXPECT_EQ(cv::imread(shot("cart.png")).size(), cv::Size(1280, 720)) << started.output;
}

/// Programs that were started with a file of that folder, by their command lines.
std::vector<std::string> programs_of(const std::filesystem::path& folder) {
  std::vector<std::string> out;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", ignored)) {
    std::ifstream in(entry.path() / "cmdline", std::ios::binary);
    std::string line((std::istreambuf_iterator<char>(in)), {});
    std::replace(line.begin(), line.end(), '\0', ' ');
    const bool ours = line.find("birdseyed --") != std::string::npos || line.find("birdseye-sim ") != std::string::npos;
    if (ours && line.find(folder.string()) != std::string::npos) out.push_back(line);
  }
  return out;
}

TEST(Live, LeavesNoProgramBehindWhenItsXServerDies) {
  const Scratch scratch;
  auto display = std::make_unique<testing::Display>("1280x720");
  const std::filesystem::path out = scratch / "live";
  testing::Child live({"env", "-u", "WAYLAND_DISPLAY", "DISPLAY=" + display->name(),
                       testing::programs_folder() + "/birdseye", "live", "--simulate", "--out", out.string()});
  for (int i = 0; i < 6000 && programs_of(out).size() < 2; ++i) ::usleep(20'000);
  ASSERT_EQ(programs_of(out).size(), 2U) << "simulator and appliance do not run";
  display.reset();
  for (int i = 0; i < 1500 && !programs_of(out).empty(); ++i) ::usleep(20'000);
  EXPECT_TRUE(programs_of(out).empty()) << programs_of(out).front();
}

TEST(Live, SaysWhatIsMissing) {
  const Scratch scratch;
  const char* nowhere = "env -u DISPLAY -u WAYLAND_DISPLAY";
  testing::expect_refused("birdseye", "live",
                          {"--server HOST:PORT, --recording PATH and --simulate", "birdseye doctor"}, "", nowhere);
  testing::expect_refused("birdseye", "live --server 127.0.0.1:1", {"--ct is missing", "birdseye doctor"}, "", nowhere);
  testing::expect_refused("birdseye", "live --server 127.0.0.1:1 --ct /no/such/ct", {"--ct /no/such/ct: no such file"});
  const std::string ct = "live --server 127.0.0.1:1 --ct " + scratch.path().string();
  testing::expect_refused("birdseye", ct + " --labels liver.nii.gz --show 2,3", {"--labels liver.nii.gz", "--organ"});
  testing::expect_refused("birdseye", ct + " --organ 1", {"give --labels"});
  (void)scratch.file("operation.json", "{}");
  testing::expect_refused("birdseye", "live --simulate --out " + scratch.path().string(),
                          {"holds an operation already", "--resume"});
  testing::expect_refused("birdseye", "live --simulate --size 3x4", {"--size: \"3x4\""});
  testing::expect_refused("birdseye", "live --simulate --script " + (scratch / "none").string(), {"none"});
  testing::expect_refused("birdseye", "live --simulate --out " + (scratch / "l").string(),
                          {"there is no display", "xvfb-run -a"}, "", nowhere);
  const testing::Display display;
  testing::expect_refused("birdseye", "live --simulate --out " + (scratch / "l").string(),
                          {"OpenGL 4.5", "libgl1-mesa-dri"}, "", display.env() + " MESA_GL_VERSION_OVERRIDE=3.3");
}

}  // namespace
}  // namespace birdseye
