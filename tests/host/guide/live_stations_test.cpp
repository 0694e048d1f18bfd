#include "host/guide/live_stations.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <tuple>
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

TEST(LiveRests, FramesThatNoPoseComesForAreCounted) {
  LiveRests rests("scope");
  EXPECT_EQ(rests.left_out_words(), "");
  for (int n = 1; n <= 20; ++n) {
    rests.push(frame_at(40 * n));
    rests.push(pose_at(40 * n, "pointer"));
  }
  EXPECT_EQ(rests.frames_left_out(), 8U);
  EXPECT_EQ(rests.left_out_words(), kLeftOut);
}

TEST(LiveRests, WherePosesComeNoFrameIsLeftOut) {
  LiveRests rests("scope");
  for (int n = 1; n <= 100; ++n) {
    rests.push(frame_at(40 * n));
    for (int part = 0; part < 4; ++part) rests.push(pose_at(40 * n + 10 * part, "scope"));
  }
  EXPECT_EQ(rests.frames_left_out(), 0U);
}

/// Held still for a second, carried on by 100 mm in half a second, held still again: two rests, each with a frame of
/// its own time and the mean of poses that scatter by 0.5 mm.
TEST(LiveRests, EachRestHasTheMeanOfItsPoses) {
  LiveRests rests("scope");
  const auto along_mm = [](int ms) { return 100 * std::clamp((ms - 1000) / 500.0, 0.0, 1.0); };
  for (int ms = 0; ms < 2500; ms += 10) {
    const double off_mm = ms % 20 == 0 ? 0.5 : -0.5;
    const Transform<Tracker, Sensor> pose(Eigen::Matrix3d::Identity(), Eigen::Vector3d(along_mm(ms) + off_mm, 0, 0));
    if (ms % 40 == 0) rests.push(frame_at(ms));
    rests.push(wire::Birds{DeviceTime{} + Duration::from_ms(ms), {{"scope", pose}}});
  }
  rests.finish();
  for (const auto& [place_mm, from_ms, to_ms] : {std::tuple{0.0, 0, 1000}, {100.0, 1500, 2500}}) {
    const auto rest = rests.take();
    ASSERT_TRUE(rest) << place_mm;
    EXPECT_NEAR(rest->tracker_from_sensor.translation().x(), place_mm, 0.05);
    EXPECT_GE(rest->frame.info.acquired, DeviceTime{} + Duration::from_ms(from_ms));
    EXPECT_LE(rest->frame.info.acquired, DeviceTime{} + Duration::from_ms(to_ms));
  }
  EXPECT_FALSE(rests.take());
  EXPECT_EQ(rests.take_remark(), "");
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
