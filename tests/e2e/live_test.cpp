// `birdseye live` over the simulated cart, from the first connection to the registered overlay, by a script alone.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "tests/support/command.hpp"
#include "tests/support/display.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::run;
using testing::Scratch;

TEST(Live, ReachesARegisteredOverlayByAScriptAlone) {
  const Scratch scratch;
  const testing::Display display("1280x720");
  const std::string out = (scratch / "live").string();
  const std::string script =
      scratch.file("script.txt", "wait connect 90\nwait calibrate 120\nshot " + out +
                                     "/calibrated.png\nwait fiducials 60\nshot " + out +
                                     "/registered.png\nkey enter\nkey enter\nkey space\nwait run 2\nsleep 8\nkey s\n"
                                     "sleep 0.5\nend\n");
  const auto result = run("birdseye",
                          "live --simulate --look-s 60 --out " + out + " --script " + script + " --json " +
                              (scratch / "live.json").string(),
                          display.env());
  ASSERT_EQ(result.code, 0) << result.output;
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(scratch / "live.json"));
  EXPECT_EQ(json["verdict"], "pass") << json;
  EXPECT_LE(json["target_error_mm_p95"].get<double>(), 3.0);
  EXPECT_GT(json["frames_overlaid"].get<int>(), 100);
  for (const char* name : {"calibrated.png", "registered.png", "snapshot-001.png"}) {
    const cv::Mat picture = cv::imread(out + "/" + name);
    EXPECT_EQ(picture.cols, 1280) << name;
    EXPECT_EQ(picture.rows, 720) << name;
  }
}

TEST(Live, SaysWhatIsMissing) {
  const Scratch scratch;
  testing::expect_refused("birdseye", "live", {"--server HOST:PORT, --recording PATH and --simulate"});
  testing::expect_refused("birdseye", "live --server 127.0.0.1:1", {"--ct is missing"});
  testing::expect_refused("birdseye", "live --simulate --size 3x4", {"--size: \"3x4\""});
  testing::expect_refused("birdseye", "live --simulate --script " + (scratch / "none").string(), {"none"});
  testing::expect_refused("birdseye", "live --simulate --out " + (scratch / "l").string(), {"there is no display"}, "",
                          "env -u DISPLAY -u WAYLAND_DISPLAY");
}

}  // namespace
}  // namespace birdseye
