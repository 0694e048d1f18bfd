// Of several devices the scope's, and what the feed tells of a server that is no appliance of ours.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "tests/device/wire/foreign_feed_fixture.hpp"

namespace birdseye::wire {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(ForeignFeed, OfSeveralDevicesTheScopesMustBeNamed) {
  const auto both = [](FeedLink& link) {
    for (int i = 0; i < 2; ++i) {
      link.transform("StylusToTracker", 10 * i, pose_at(500));
      link.transform("ProbeToTracker", 10 * i, pose_at(1));
    }
    link.image(10);
  };
  FeedLink unnamed;
  both(unnamed);
  std::vector<std::string> told;
  for (const Event& event : unnamed.events(50)) {
    if (const auto* status = std::get_if<Status>(&event)) told.push_back(status->text);
    if (const auto* frame = std::get_if<VideoFrame>(&event)) {
      EXPECT_EQ(frame->info.pose.kind, PoseKind::refused);
      told.push_back(frame->info.pose.reason);
    }
  }
  EXPECT_THAT(
      told, ::testing::Each(AllOf(HasSubstr("\"ProbeToTracker\", \"StylusToTracker\""), HasSubstr("--scope-device"))));
  EXPECT_EQ(told.size(), 2U);

  FeedLink named({.scope_device = "ProbeToTracker"});
  both(named);
  std::set<std::string> birds;
  for (const Event& event : named.events(50)) {
    EXPECT_FALSE(std::holds_alternative<Status>(event));
    if (const auto* frame = std::get_if<VideoFrame>(&event)) {
      EXPECT_LT(distance_mm(frame->info.pose, pose_at(1)), 1e-3);
    }
    if (const auto* found = std::get_if<Birds>(&event)) birds.insert(found->birds[0].name);
  }
  EXPECT_THAT(birds, ::testing::ElementsAre("StylusToTracker", "scope"));

  FeedLink wrong({.scope_device = "Probe"});
  both(wrong);
  const auto status = wrong.of<Status>(50);
  ASSERT_EQ(status.size(), 1U);
  EXPECT_THAT(status[0].text, AllOf(HasSubstr("no poses of \"Probe\""), HasSubstr("\"StylusToTracker\"")));
}

TEST(ForeignFeed, AnotherDevicesPosesNeverPassForTheScopes) {
  FeedLink link({.scope_device = "ProbeToTracker"});
  link.transform("scope", 0, pose_at(900));
  link.transform("ProbeToTracker", 0, pose_at(1));
  link.transform("TrackerToProbe", 0, pose_at(-1));
  const auto birds = link.of<Birds>(5);
  ASSERT_EQ(birds.size(), 1U);
  EXPECT_EQ(birds[0].birds[0].name, "scope");
  EXPECT_NEAR(birds[0].birds[0].tracker_from_sensor.translation().x(), 1, 1e-4);
  EXPECT_THAT(link.feed.words(), HasSubstr("\"TrackerToProbe\", which by its name is the way back"));
}

TEST(ForeignFeed, ThePointersPosesAreNeverTheScopes) {
  FeedLink link({.not_scope = "StylusToTracker"});
  for (int i = 0; i < 2; ++i) link.transform("StylusToTracker", 10 * i, pose_at(500));
  link.image(10);
  bool told = false;
  for (const Event& event : link.events(50)) {
    if (const auto* frame = std::get_if<VideoFrame>(&event)) {
      EXPECT_EQ(frame->info.pose.kind, PoseKind::refused);
    }
    if (const auto* birds = std::get_if<Birds>(&event)) {
      EXPECT_EQ(birds->birds[0].name, "StylusToTracker");
    }
    if (const auto* status = std::get_if<Status>(&event))
      told = told || status->text == "of poses only the pointer's come, \"StylusToTracker\"";
  }
  EXPECT_TRUE(told);
  // Its scope comes into sight: that is the only other one.
  for (int i = 0; i < 2; ++i) link.transform("ProbeToTracker", 100 + 10 * i, pose_at(1));
  link.image(110);
  for (const VideoFrame& frame : link.of<VideoFrame>(160)) EXPECT_LT(distance_mm(frame.info.pose, pose_at(1)), 1e-3);
}

TEST(ForeignFeed, OfSeveralVideosTheScopesMustBeNamed) {
  FeedLink link;
  link.image(0);
  link.push(image_message("Ultrasound", FeedLink::at(5), {}), 5);
  const auto told = link.of<Status>(50);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0].text, AllOf(HasSubstr("\"Endo\", \"Ultrasound\""), HasSubstr("--video-device")));
  FeedLink named({.video_device = "Ultrasound"});
  named.image(0);
  named.push(image_message("Ultrasound", FeedLink::at(5), {.width = 7}), 5);
  const auto frames = named.of<VideoFrame>(50);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].width_px, 7);
}

TEST(ForeignFeed, ItIsToldWhatDoesNotCome) {
  FeedLink video;
  video.image(0);
  EXPECT_TRUE(video.of<Status>(100).empty()) << "poses may come yet";
  video.image(2500);
  auto told = video.of<Status>(2510);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0].text, HasSubstr("video and no poses"));
  FeedLink poses;
  for (int i = 0; i < 26; ++i) poses.transform("ProbeToTracker", 100 * i, pose_at(i));
  told = poses.of<Status>(2510);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0].text, HasSubstr("poses and no video"));
  // A tool that leaves the tracker's sight.
  poses.image(2520);
  told = poses.of<Status>(2600);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_TRUE(told[0].ok);
  poses.transform("ProbeToTracker", 4900, Eigen::Isometry3d::Identity());
  poses.image(4900);
  told = poses.of<Status>(4950);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_THAT(told[0].text, HasSubstr("\"ProbeToTracker\" sends no poses now"));
}

TEST(ForeignFeed, OtherTypesAreNamedOnce) {
  FeedLink link;
  for (int i = 0; i < 3; ++i) {
    for (const char* type : {"POLYDATA", "VIDEO", "STRING", "RTS_TDATA"})
      link.push(testing::foreign_message(type, "Any", FeedLink::at(i), {1, 2, 3}), i);
    link.push(image_message("CT", FeedLink::at(i), {.slices = 4, .components = 1}), i);
  }
  EXPECT_TRUE(link.events(10).empty());
  EXPECT_EQ(link.feed.words(),
            "an OpenIGTLink server that is no appliance of Birdseye; passed over: IMAGE of several slices, POLYDATA, "
            "STRING, VIDEO")
      << "the answer to what is asked is nothing to tell";
}

TEST(ForeignFeed, AServersOwnStatusIsToldWhereItIsNotWell) {
  FeedLink link;
  const auto status = [](unsigned code, const std::string& text) {
    testing::Bytes content;
    testing::put(content, code, 2);
    testing::put(content, 0, 8);
    testing::put_text(content, "", 20);
    testing::put_text(content, text, text.size());  // with no zero at its end
    return testing::foreign_message("STATUS", "", FeedLink::at(1), content);
  };
  link.push(status(1, "fine"), 1);
  EXPECT_EQ(link.feed.words(), "an OpenIGTLink server that is no appliance of Birdseye");
  link.push(status(13, "no\ttracker"), 2);
  EXPECT_THAT(link.feed.words(), HasSubstr("; it says: status 13: no?tracker"));
  link.push(status(1, ""), 3);
  EXPECT_EQ(link.feed.words(), "an OpenIGTLink server that is no appliance of Birdseye");
  link.push(testing::foreign_message("STATUS", "", FeedLink::at(4), {0, 1}), 4);
  EXPECT_THAT(link.feed.words(), HasSubstr("1 damaged messages"));
}

}  // namespace
}  // namespace birdseye::wire
