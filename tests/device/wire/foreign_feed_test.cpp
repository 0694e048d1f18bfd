// Pictures and poses of a server that is no appliance of ours, and their times.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/device/wire/foreign_feed_fixture.hpp"

namespace birdseye::wire {
namespace {

using ::testing::HasSubstr;

TEST(ForeignFeed, APoseIsInterpolatedAtThePicturesTimeOnTheServersClock) {
  FeedLink link;
  for (int i = 0; i <= 3; ++i) link.transform("ProbeToTracker", 20 * i, pose_at(10.0 * i));
  link.image(70);  // moves 10 mm in 20 ms, and the measurement after it is not there yet
  EXPECT_TRUE(link.of<VideoFrame>(73).empty());
  ASSERT_TRUE(link.feed.due());
  link.transform("ProbeToTracker", 80, pose_at(40));
  const auto frames = link.of<VideoFrame>(83);
  ASSERT_EQ(frames.size(), 1U);
  const FrameInfo& info = frames[0].info;
  EXPECT_EQ(FeedLink::ms_of(info.acquired), 70);
  EXPECT_EQ(info.pose.kind, PoseKind::interpolated);
  EXPECT_LT(distance_mm(info.pose, pose_at(35)), 1e-3);
  EXPECT_NEAR(info.pose.speed_mm_s, 500, 1);
  EXPECT_FALSE(link.feed.due());
}

TEST(ForeignFeed, ATransformOfThePicturesOwnStampIsItsPoseThoughItComesAfter) {
  FeedLink link;  // as PLUS sends them
  for (int i = 0; i < 5; ++i) {
    link.image(50 * i);
    EXPECT_TRUE(link.of<VideoFrame>(50 * i + 2).empty());
    link.push(transform_message("ProbeToTracker", FeedLink::at(50 * i), pose_at(i)), 50 * i + 1);
    const auto frames = link.of<VideoFrame>(50 * i + 3);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].info.sequence, static_cast<std::uint64_t>(i));
    EXPECT_EQ(frames[0].info.pose.kind, PoseKind::exact);
    EXPECT_LT(distance_mm(frames[0].info.pose, pose_at(i)), 1e-4);
  }
}

TEST(ForeignFeed, APictureWaitsForPosesNoLongerThanItMay) {
  FeedLink link;
  for (const int ms : {0, 10, 14, 20}) link.transform("ProbeToTracker", ms, pose_at(ms / 2));
  link.image(30);
  EXPECT_TRUE(link.of<VideoFrame>(60).empty());
  const auto frames = link.of<VideoFrame>(75);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].info.pose.kind, PoseKind::predicted);
  EXPECT_LT(distance_mm(frames[0].info.pose, pose_at(15)), 1e-3);
  link.image(900);  // long after the last pose: none is made up
  const auto late = link.of<VideoFrame>(1000);
  ASSERT_EQ(late.size(), 1U);
  EXPECT_EQ(late[0].info.pose.kind, PoseKind::refused);
  EXPECT_THAT(late[0].info.pose.reason, HasSubstr("880 ms old"));
}

TEST(ForeignFeed, PicturesOfEitherHeaderGreyOrColouredComeAsTheyWereSent) {
  for (const unsigned version : {1U, 2U}) {
    for (const int components : {1, 3}) {
      FeedLink link;
      link.push(image_message("Endo", FeedLink::at(0, version), {.components = components, .first = 9}), 0);
      const auto frames = link.of<VideoFrame>(50);
      ASSERT_EQ(frames.size(), 1U) << version << components;
      EXPECT_EQ(frames[0].width_px, 4);
      EXPECT_EQ(frames[0].height_px, 3);
      ASSERT_EQ(frames[0].rgb->size(), 36U);
      for (int i = 0; i < 36; ++i)
        EXPECT_EQ((*frames[0].rgb)[static_cast<std::size_t>(i)], 9 + (components == 3 ? i : i / 3));
    }
  }
}

TEST(ForeignFeed, APoseThatRepeatsItselfForASecondIsNoMeasurement) {
  FeedLink link;
  std::vector<VideoFrame> frames;
  for (int ms = 0; ms <= 2600; ms += 20) {
    // It moves, stands for 1.4 s, moves again.
    const int moved = ms < 600 ? ms : ms < 2000 ? 600 : ms;
    link.transform("ProbeToTracker", ms, pose_at(moved * 1e-3));
    if (ms % 100 == 0) link.image(ms);
    for (VideoFrame& frame : link.of<VideoFrame>(ms + 5)) frames.push_back(std::move(frame));
  }
  ASSERT_GT(frames.size(), 20U);
  for (const VideoFrame& frame : frames) {
    const auto ms = FeedLink::ms_of(frame.info.acquired);
    EXPECT_EQ(frame.info.pose.tracker_from_sensor.has_value(), ms <= 1600 || ms >= 2000) << ms;
    if (ms <= 1600 || ms >= 2000) continue;
    EXPECT_THAT(frame.info.pose.reason, HasSubstr("\"ProbeToTracker\" stands still to the last digit"));
  }
}

TEST(ForeignFeed, PicturesMayChangeTheirSize) {
  FeedLink link;
  link.transform("ProbeToTracker", 0, pose_at(1));
  link.image(0, {.width = 8, .height = 6});
  link.image(10, {.width = 5, .height = 7, .components = 1});
  link.transform("ProbeToTracker", 20, pose_at(1));
  const auto frames = link.of<VideoFrame>(25);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].rgb->size(), 8U * 6 * 3);
  EXPECT_EQ(frames[1].width_px, 5);
  EXPECT_EQ(frames[1].height_px, 7);
  EXPECT_EQ(frames[1].rgb->size(), 5U * 7 * 3);
}

TEST(ForeignFeed, WithoutTimesThereIsVideoAndNoPose) {
  FeedLink link;
  link.push(transform_message("ProbeToTracker", {}, pose_at(1)), 0);
  link.push(image_message("Endo", {}, {}), 3);
  bool framed = false;
  for (const Event& event : link.events(10)) {
    if (const auto* status = std::get_if<Status>(&event)) {
      EXPECT_THAT(status->text, HasSubstr("no time"));
    }
    const auto* frame = std::get_if<VideoFrame>(&event);
    if (frame == nullptr) continue;
    framed = true;
    EXPECT_EQ(frame->info.pose.kind, PoseKind::refused);
    EXPECT_THAT(frame->info.pose.reason, HasSubstr("no time"));
    EXPECT_EQ(frame->info.acquired_sigma, Duration::from_ms(50));
    const auto related = link.feed.host_from_device(frame->info.acquired);
    ASSERT_TRUE(related);
    EXPECT_EQ(related->time, FeedLink::host(3) + Duration{kWayNs}) << "when it came";
    EXPECT_GE(related->sigma, Duration::from_ms(50));
  }
  EXPECT_TRUE(framed);
  // Pictures with times and poses without are no better.
  FeedLink half;
  half.push(transform_message("ProbeToTracker", {}, pose_at(1)), 0);
  half.image(0);
  const auto frames = half.of<VideoFrame>(10);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_THAT(frames[0].info.pose.reason, HasSubstr("\"ProbeToTracker\" gives its poses no time"));
}

TEST(ForeignFeed, AClockThatIsMovedBackStartsAnew) {
  FeedLink link;
  for (int i = 0; i < 50; ++i) link.transform("ProbeToTracker", 20 * i, pose_at(i));
  (void)link.events(1000);
  // The server plays its recording again: an hour earlier by its stamps.
  constexpr std::int64_t kHourMs = 3'600'000;
  bool told = false;
  for (int i = 50; i < 300; ++i) {
    link.push(transform_message("ProbeToTracker", FeedLink::at(20 * i - kHourMs), pose_at(i)), 20 * i);
    link.push(image_message("Endo", FeedLink::at(20 * i - kHourMs), {}), 20 * i);
    for (const Event& event : link.events(20 * i + 5)) {
      told = told || std::holds_alternative<ClockChange>(event);
      if (const auto* frame = std::get_if<VideoFrame>(&event); frame != nullptr && i > 51) {
        EXPECT_LT(distance_mm(frame->info.pose, pose_at(i)), 1e-3) << i;
      }
    }
  }
  EXPECT_TRUE(told);
  const auto related = link.feed.host_from_device({FeedLink::at(6000 - kHourMs).stamp_ns});
  EXPECT_NEAR(Duration{related->time.ns - FeedLink::host(6000).ns}.seconds() * 1e3, 2 - 20, 2);
}

}  // namespace
}  // namespace birdseye::wire
