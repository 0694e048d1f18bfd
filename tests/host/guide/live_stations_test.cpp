#include "host/guide/live_stations.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "host/guide/hand_eye_guide.hpp"

namespace birdseye::host {
namespace {

using ::testing::Contains;
using ::testing::Not;

const char* const kLeftOut = "8 frames were left out: no poses of \"scope\" came for them in time";

calibration::Pattern board() {
  return *calibration::parse_pattern("chessboard:10x7:6mm");
}

wire::VideoFrame frame_at(int ms) {
  wire::VideoFrame frame;
  frame.info.acquired = DeviceTime{} + Duration::from_ms(ms);
  frame.width_px = 32;
  frame.height_px = 24;
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(3 * 32 * 24, std::uint8_t{90});
  return frame;
}

wire::Birds pose_at(int ms, const char* bird) {
  return {DeviceTime{} + Duration::from_ms(ms), {{bird, {}}}};
}

TEST(LiveStations, FramesThatNoPoseComesForAreCounted) {
  LiveStations stations(board(), "scope");
  EXPECT_EQ(stations.left_out_words(), "");
  for (int n = 1; n <= 20; ++n) {
    stations.push(frame_at(40 * n));
    stations.push(pose_at(40 * n, "pointer"));
  }
  EXPECT_EQ(stations.frames_left_out(), 8U);
  EXPECT_EQ(stations.left_out_words(), kLeftOut);
}

TEST(LiveStations, WherePosesComeNoFrameIsLeftOut) {
  LiveStations stations(board(), "scope");
  for (int n = 1; n <= 100; ++n) {
    stations.push(frame_at(40 * n));
    for (int part = 0; part < 4; ++part) stations.push(pose_at(40 * n + 10 * part, "scope"));
  }
  EXPECT_EQ(stations.frames_left_out(), 0U);
}

TEST(HandEyeGuide, TellsHowManyFramesWereLeftOut) {
  const auto told_after = [](int frames) {
    std::vector<std::string> lines;
    GuidePlan plan;
    plan.pattern = board();
    HandEyeGuide guide(plan, {[](const std::string&) {}, [&](const std::string& line) { lines.push_back(line); }});
    for (int n = 1; n <= frames; ++n) EXPECT_TRUE(guide.take(frame_at(40 * n)));
    guide.end("interrupted");
    (void)guide.finish();
    return lines;
  };
  EXPECT_THAT(told_after(20), Contains(kLeftOut));
  EXPECT_THAT(told_after(12), Not(Contains(::testing::HasSubstr("left out"))));
}

}  // namespace
}  // namespace birdseye::host
