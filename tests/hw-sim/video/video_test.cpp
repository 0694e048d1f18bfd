#include <gtest/gtest.h>

#include "drivers/system/clock.hpp"
#include "drivers/video/frame_source.hpp"
#include "hw-sim/video/camera_script.hpp"
#include "hw-sim/video/frame_sink.hpp"
#include "hw-sim/video/test_pattern.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/test_picture.hpp"

namespace birdseye::hw_sim {
namespace {

using testing::number_in_picture;
constexpr std::int64_t kZeroNs = 5'000'000'000;

Fault video_fault(FaultKind kind, double at_s, std::optional<double> for_s = std::nullopt,
                  std::map<std::string, double, std::less<>> values = {}) {
  return {kind, at_s, for_s, std::move(values)};
}

/// The first frames of a camera that is watched from the first.
std::vector<FramePlan> frames_of(CameraTiming timing, int count) {
  CameraScript script(timing, kZeroNs);
  script.watched(kZeroNs);
  std::vector<FramePlan> frames;
  for (int i = 0; i < count; ++i) frames.push_back(script.next());
  return frames;
}

TEST(TestPattern, TellsItsNumberInEveryLayoutAndSize) {
  for (const char* name : {"RGB3", "YUYV", "UYVY", "NV12", "GREY"}) {
    for (const auto& [width, height] : {std::pair{64, 64}, {1920, 1080}, {720, 576}}) {
      TestPattern pattern(*frame_format_of(name), width, height);
      for (const std::uint32_t number : {0U, 1U, 0xFFFFFFFFU, 0x8001U, 123456789U}) {
        const auto pixels = pattern.draw(number, 0.1 * number, 0.016);
        EXPECT_EQ(pixels.size(), frame_bytes(*frame_format_of(name), width, height));
        EXPECT_EQ(number_in_picture(pixels, name, width), number) << name << width;
      }
    }
  }
  EXPECT_FALSE(frame_format_of("MJPG"));
}

/// The bar's left edge in a row of a grey picture.
int bar_in_row(std::span<const std::uint8_t> pixels, int width, int row) {
  for (int x = 0; x < width; ++x) {
    if (pixels[static_cast<std::size_t>(row * width + x)] == 255) return x;
  }
  return -1;
}

TEST(TestPattern, TheBarTellsWhenEachRowWasExposed) {
  constexpr int kWidth = 640, kHeight = 480;
  TestPattern pattern(FrameFormat::grey, kWidth, kHeight);
  for (const double at_s : {0.3, 1.0, 0.5, 1.7}) {  // back too: a frame is drawn over any other
    const auto pixels = pattern.draw(7, at_s, 0);
    for (const int row : {16, 240, 479}) EXPECT_NEAR(bar_in_row(pixels, kWidth, row), at_s / 2 * kWidth, 2) << at_s;
  }
  const auto rolled = pattern.draw(8, 1.0, 0.1);
  for (const int row : {16, 240, 479}) {
    const double row_s = 1.0 + (row / 480.0 - 0.5) * 0.1;
    EXPECT_NEAR(bar_in_row(rolled, kWidth, row), row_s / 2 * kWidth, 2) << row;
  }
  // Nothing of the bars before is left.
  int white = 0;
  for (int x = 0; x < kWidth; ++x) white += rolled[static_cast<std::size_t>(300 * kWidth + x)] == 255 ? 1 : 0;
  EXPECT_EQ(white, kWidth / 32);
}

TEST(CameraScript, ExposesOnAnAbsoluteScheduleWithItsDrift) {
  CameraTiming timing;
  timing.drift_ppm = 100;
  timing.jitter_ms = 3;
  const auto frames = frames_of(timing, 3000);
  double late_sum_ms = 0;
  std::int64_t before_ns = 0;
  for (const FramePlan& plan : frames) {
    const double exposed_s = static_cast<double>(plan.exposed_ns - kZeroNs) * 1e-9;
    EXPECT_NEAR(exposed_s, static_cast<double>(plan.number) / (60 * 1.0001), 1e-8);
    EXPECT_EQ(plan.stamp_ns, plan.exposed_ns);
    EXPECT_EQ(plan.sequence, plan.number);
    EXPECT_GE(plan.due_ns, std::max(before_ns, plan.exposed_ns + 12'000'000));
    EXPECT_LE(plan.due_ns, plan.exposed_ns + 24'000'000);
    before_ns = plan.due_ns;
    late_sum_ms += static_cast<double>(plan.due_ns - plan.exposed_ns) * 1e-6 - 12;
  }
  EXPECT_NEAR(late_sum_ms / 3000, 3, 0.2);
}

TEST(CameraScript, WithoutStampsTheTimeIsUnknown) {
  CameraTiming timing;
  timing.stamps = false;
  for (const FramePlan& plan : frames_of(timing, 10)) {
    EXPECT_EQ(plan.stamp_ns, 0);
    EXPECT_EQ(plan.sigma_ns, 0);
  }
}

TEST(CameraScript, ALongExposureDelaysDelivery) {
  CameraTiming timing;
  timing.exposure_ms = 40;
  timing.rate_hz = 20;
  const auto frames = frames_of(timing, 2);
  EXPECT_EQ(frames[1].due_ns - frames[1].exposed_ns, 20'000'000);
}

TEST(CameraFaults, EachShowsInItsFrames) {
  const auto during = [](const Fault& one) {
    CameraTiming timing;
    timing.faults = {one};
    const auto frames = frames_of(timing, 180);
    for (int i = 0; i < 60; ++i) {
      EXPECT_FALSE(frames[static_cast<std::size_t>(i)].lost);
      EXPECT_EQ(frames[static_cast<std::size_t>(i)].copies, 1);
    }
    EXPECT_FALSE(frames[150].lost || frames[150].half_size || frames[150].garbage_bytes > 0 || frames[150].part < 1);
    return std::vector<FramePlan>(frames.begin() + 61, frames.begin() + 119);
  };
  for (const FramePlan& plan : during(video_fault(FaultKind::silence, 1, 1))) EXPECT_TRUE(plan.lost);
  for (const FramePlan& plan : during(video_fault(FaultKind::duplicate_frames, 1, 1, {{"chance", 1}}))) {
    EXPECT_EQ(plan.copies, 2);
  }
  for (const FramePlan& plan : during(video_fault(FaultKind::late_frames, 1, 1, {{"ms", 30}}))) {
    EXPECT_EQ(plan.due_ns - plan.exposed_ns, 42'000'000);
  }
  for (const FramePlan& plan : during(video_fault(FaultKind::garbage, 1, 1, {{"chance", 1}, {"bytes", 7}}))) {
    EXPECT_EQ(plan.garbage_bytes, 7U);
  }
  for (const FramePlan& plan : during(video_fault(FaultKind::size_change, 1, 1))) EXPECT_TRUE(plan.half_size);
  for (const FramePlan& plan : during(video_fault(FaultKind::torn_frame, 1, 1, {{"chance", 1}, {"part", 0.25}}))) {
    EXPECT_EQ(plan.part, 0.25);
  }
  for (const FramePlan& plan : during(video_fault(FaultKind::clock_step, 1, 1, {{"ms", -15}}))) {
    EXPECT_EQ(plan.stamp_ns - plan.exposed_ns, -15'000'000);
  }
  int lost = 0;
  for (const FramePlan& plan : during(video_fault(FaultKind::drop_frames, 1, 1, {{"chance", 0.5}}))) {
    lost += plan.lost ? 1 : 0;
    EXPECT_EQ(plan.sequence, plan.number);
  }
  EXPECT_NEAR(lost, 29, 14);
}

TEST(CameraFaults, AGapIsInTheCountAndNotInTheFrames) {
  CameraTiming timing;
  timing.faults = {video_fault(FaultKind::sequence_gap, 1, std::nullopt, {{"chance", 0.1}, {"frames", 5}})};
  const auto frames = frames_of(timing, 120);
  for (const FramePlan& plan : frames) {
    EXPECT_FALSE(plan.lost);
    EXPECT_EQ(plan.sequence - plan.number, plan.number < 60 ? 0U : 5U) << plan.number;
  }
}

TEST(CameraFaults, WhatAFrameSuffersDoesNotDependOnWhenItIsAskedFor) {
  CameraTiming timing;
  timing.faults = {video_fault(FaultKind::drop_frames, 1, 1, {{"chance", 0.5}}),
                   video_fault(FaultKind::unplug, 1, 0.5)};
  const auto frames = frames_of(timing, 200);
  CameraScript late(timing, kZeroNs);
  late.watched(kZeroNs);
  for (const FramePlan& plan : frames) {
    late.advance(kZeroNs + 4'000'000'000);
    EXPECT_EQ(late.next().lost, plan.lost);
  }
}

TEST(CameraFaults, NothingBeginsUntilSomebodyWatches) {
  CameraTiming timing;
  timing.faults = {video_fault(FaultKind::silence, 0, 1)};
  CameraScript script(timing, kZeroNs);
  for (int i = 0; i < 120; ++i) EXPECT_FALSE(script.next().lost);
  script.watched(kZeroNs + 2'000'000'000);
  EXPECT_TRUE(script.next().lost);
}

/// Frames through the socket, read by the driver, which shares nothing with the sender but the page of the manual.
TEST(FrameSocket, FramesArriveAsPlannedAndAReaderMayComeAgain) {
  const testing::Scratch scratch;
  const auto sink = listen_for_frames(scratch / "frames", 1);
  ASSERT_TRUE(sink) << sink.error().what;
  TestPattern pattern(FrameFormat::rgb3, 96, 64);
  for (int reader = 0; reader < 3; ++reader) {
    drivers::CameraSettings settings;
    settings.source = "socket:" + (scratch / "frames").string();
    const auto camera = drivers::open_camera(settings);
    ASSERT_TRUE(camera) << camera.error().what;
    while (!(*sink)->connected()) (*sink)->work(device_now().ns + 10'000'000);
    for (const FramePlan& plan : frames_of({}, 5)) {
      const auto pixels = pattern.draw(plan.number, 0, 0);
      (*sink)->begin(plan, {pixels, FrameFormat::rgb3, 96, 64});
      while ((*sink)->busy()) (*sink)->work(device_now().ns + 10'000'000);
      const auto frame = (*camera)->next(device_now() + Duration::from_ms(2000));
      ASSERT_TRUE(frame) << frame.error().what;
      ASSERT_TRUE(*frame);
      EXPECT_EQ((*frame)->sequence, plan.sequence);
      EXPECT_EQ((*frame)->acquired.ns, plan.stamp_ns);
    }
    (*sink)->unplug();
    EXPECT_FALSE((*sink)->connected());
    EXPECT_FALSE(drivers::open_camera(settings));
    ASSERT_TRUE((*sink)->replug());
  }
}

TEST(VideoOutput, NamesWhatIsNoOutputNode) {
  const auto missing = open_video_output("/nonexistent", FrameFormat::rgb3, 64, 64, 30, 1);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, Errc::unreadable);
  const auto null = open_video_output("/dev/null", FrameFormat::rgb3, 64, 64, 30, 1);
  ASSERT_FALSE(null);
  EXPECT_EQ(null.error().code, Errc::unsupported);
}

}  // namespace
}  // namespace birdseye::hw_sim
