// What the window says of a source with which something is wrong; it stays open, and shows nothing as live that is not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "host/recording/recording_writer.hpp"
#include "tests/e2e/fault_rig.hpp"
#include "tests/support/command.hpp"
#include "tests/support/display.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/small_ct.hpp"
#include "tests/support/this_machine.hpp"

namespace birdseye::testing {
namespace {

using ::testing::HasSubstr;

/// A window that is open for some seconds.
class LiveTrouble : public ::testing::Test {
 protected:
  /// What it says at its end. The picture it shows then is shot().
  nlohmann::json says(const std::string& source, double seconds) {
    const std::string script = scratch_.file(
        "script.txt", "sleep " + std::to_string(seconds) + "\nshot " + (scratch_ / "shot.png").string() + "\nend\n");
    const auto result = run("birdseye",
                            "live " + source + " --ct " + small_ct(scratch_) + " --scale 1 --script " + script +
                                " --json " + (scratch_ / "live.json").string(),
                            display_.env());
    EXPECT_EQ(result.code, 0) << result.output;
    return nlohmann::json::parse(std::ifstream(scratch_ / "live.json"), nullptr, false);
  }
  /// The middle of the video, BGR.
  [[nodiscard]] cv::Vec3b middle() const {
    const cv::Mat shot = cv::imread(scratch_ / "shot.png");
    EXPECT_EQ(shot.size(), cv::Size(1280, 720));
    return shot.empty() ? cv::Vec3b() : shot.at<cv::Vec3b>(330, 805);
  }

  Scratch scratch_;
  Display display_{"1280x720"};
};

wire::VideoFrame green_frame(int number, int width_px, int height_px) {
  wire::VideoFrame frame;
  frame.info.sequence = static_cast<std::uint64_t>(number);
  frame.info.acquired = {1'000'000'000 + 40'000'000LL * number};
  frame.info.arrived = {frame.info.acquired.ns + 20'000'000};
  frame.info.pose.reason = "the tracker is silent";
  frame.width_px = width_px;
  frame.height_px = height_px;
  auto rgb = std::make_shared<std::vector<std::uint8_t>>();
  for (int i = 0; i < width_px * height_px; ++i) rgb->insert(rgb->end(), {40, 160, 60});
  frame.rgb = rgb;
  return frame;
}

/// Frames of one size and then of another; finished: not cut short.
std::string recording(const Scratch& scratch, int frames, bool finished) {
  auto writer = host::RecordingWriter::create(
      {.folder = scratch / "recording", .source = "test", .machine = testing::authors().machine});
  EXPECT_TRUE(writer) << writer.error().what;
  for (int n = 0; n < frames; ++n) {
    const bool small = 2 * n >= frames;
    EXPECT_TRUE((*writer)->add(green_frame(n, small ? 80 : 160, small ? 60 : 120)));
  }
  if (finished) {
    EXPECT_TRUE((*writer)->finish("the test is over"));
  }
  return (scratch / "recording").string();
}

TEST_F(LiveTrouble, ARecordingThatWasCutShortIsPlayedAndSaysSo) {
  const std::string cut = "--recording " + recording(scratch_, 30, false);  // so that nobody has signed it
  const auto json = says(cut + " --accept-unsigned", 3.5);
  EXPECT_THAT(json["link_says"].get<std::string>(), HasSubstr("it was cut short while it was recorded"));
  EXPECT_GT(json["frames"].get<int>(), 10);
  EXPECT_EQ(middle(), cv::Vec3b(56, 56, 56)) << "it has ended: half of its luma, without colours";
}

TEST_F(LiveTrouble, ASizeThatChangesInTheMidstIsShown) {
  const auto json = says("--recording " + recording(scratch_, 160, true), 4.8);
  EXPECT_GT(json["frames"].get<int>(), 82) << "the second size had its turn";
  EXPECT_EQ(middle(), cv::Vec3b(60, 160, 40)) << "it still runs";
}

TEST_F(LiveTrouble, PosesWithoutVideo) {
  FaultRig rig({.folder = scratch_ / "cart", .camera = false});
  ASSERT_TRUE(rig.failure().empty()) << rig.failure();
  const auto json = says("--server 127.0.0.1:" + std::to_string(rig.port()), 3);
  EXPECT_THAT(json["link_says"].get<std::string>(), HasSubstr("connected"));
  EXPECT_EQ(json["picture_says"], "no video has come yet");
  EXPECT_EQ(json["frames"], 0);
}

TEST_F(LiveTrouble, VideoWithoutPoses) {
  FaultRig rig({.folder = scratch_ / "cart", .tracker = false});
  ASSERT_TRUE(rig.failure().empty()) << rig.failure();
  const auto json = says("--server 127.0.0.1:" + std::to_string(rig.port()), 3);
  EXPECT_GT(json["frames"].get<int>(), 20);
  EXPECT_EQ(json["frames_overlaid"], 0);
  EXPECT_THAT(json["appliance_says"].get<std::string>(), HasSubstr("is the tracker plugged in"));
}

}  // namespace
}  // namespace birdseye::testing
