// Servers that are no appliances of ours: their messages byte by byte, at times that the test makes.
#include "device/wire/foreign_feed.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "device/wire/unpacker.hpp"
#include "tests/support/foreign_messages.hpp"

namespace birdseye::wire {
namespace {

using ::testing::AllOf;
using testing::Bytes;
using testing::Envelope;
using testing::ForeignImage;
using ::testing::HasSubstr;
using testing::image_message;
using testing::put_float;
using testing::put_matrix;
using testing::put_text;
using testing::transform_message;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kServerNs = 1'790'000'000'000'000'000;  // seconds since 1970
constexpr std::int64_t kHostNs = 5'000'000'000'000;            // since this machine was started
constexpr std::int64_t kWayNs = 2 * kMs;

Eigen::Isometry3d pose_at(double x_mm, double angle_rad = 0.3) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = Eigen::Vector3d(x_mm, -20.5, 310);
  pose.linear() = Eigen::AngleAxisd(angle_rad, Eigen::Vector3d(1, 2, -2).normalized()).toRotationMatrix();
  return pose;
}

/// A feed, and a server whose milliseconds are those of the test.
struct FeedLink {
  explicit FeedLink(ForeignSettings settings = {}) : feed(std::move(settings), host(0)) {}
  static HostTime host(std::int64_t ms) { return {kHostNs + ms * kMs}; }
  static Envelope at(std::int64_t ms, unsigned version = 1) { return {kServerNs + ms * kMs, version}; }
  static std::int64_t ms_of(DeviceTime time) { return (time.ns - kServerNs) / kMs; }

  void push(const Bytes& message, HostTime arrived) {
    const auto header = read_header(message, kLargestBody);
    ASSERT_TRUE(header);
    feed.push(*header, std::span(message).subspan(kHeaderBytes), arrived);
  }
  /// Comes a way's time after the server's milliseconds.
  void push(const Bytes& message, std::int64_t sent_ms) { push(message, host(sent_ms) + Duration{kWayNs}); }
  void transform(const std::string& device, std::int64_t ms, const Eigen::Isometry3d& pose) {
    push(transform_message(device, at(ms), pose), ms);
  }
  void image(std::int64_t ms, const ForeignImage& picture = {}) { push(image_message("Endo", at(ms), picture), ms); }

  std::vector<Event> events(std::int64_t now_ms) {
    std::vector<Event> all;
    while (auto event = feed.next(host(now_ms))) all.push_back(*std::move(event));
    return all;
  }
  template <typename T>
  std::vector<T> of(std::int64_t now_ms) {
    std::vector<T> found;
    for (const Event& event : events(now_ms)) {
      if (const auto* one = std::get_if<T>(&event)) found.push_back(*one);
    }
    return found;
  }

  ForeignFeed feed;
};

double distance_mm(const PoseAnswer& pose, const Eigen::Isometry3d& expected) {
  return pose.tracker_from_sensor ? (pose.tracker_from_sensor->matrix() - expected.matrix()).cwiseAbs().maxCoeff()
                                  : 1e9;
}

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
  link.transform("ProbeToTracker", 0, pose_at(0));
  link.transform("ProbeToTracker", 20, pose_at(10));
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

TEST(ForeignFeed, PosesOfAllTypesAreTheSame) {
  const Eigen::Isometry3d pose = pose_at(12.25, 1.1);
  const Eigen::Quaterniond q(pose.linear());
  const auto quaternion = [&](Bytes& out, bool whole) {
    for (const double v : pose.translation()) put_float(out, v);
    for (const double v : {q.x(), q.y(), q.z()}) put_float(out, v);
    if (whole) put_float(out, q.w());
  };
  Bytes tdata, qtdata, position, short_position;
  put_text(tdata, "Stylus", 20);
  put_text(tdata, "\2", 2);
  put_matrix(tdata, pose);
  put_text(qtdata, "Stylus", 20);
  put_text(qtdata, "\2", 2);
  quaternion(qtdata, true);
  quaternion(position, true);
  quaternion(short_position, false);
  const auto wrapped = [](const char* type, const char* device, unsigned version, const Bytes& content) {
    return testing::foreign_message(type, device, FeedLink::at(0, version), content);
  };
  for (const unsigned version : {1U, 2U}) {
    for (const Bytes& message :
         {wrapped("TDATA", "Tracker", version, tdata), wrapped("QTDATA", "T", version, qtdata),
          wrapped("POSITION", "Stylus", version, position), wrapped("QTRANS", "Stylus", version, short_position),
          transform_message("Stylus", FeedLink::at(0, version), pose)}) {
      FeedLink link({.scope_device = "another"});
      link.push(message, 0);
      const auto birds = link.of<Birds>(5);
      ASSERT_EQ(birds.size(), 1U) << message[2] << version;
      ASSERT_EQ(birds[0].birds.size(), 1U);
      EXPECT_EQ(birds[0].birds[0].name, "Stylus");
      EXPECT_LT((birds[0].birds[0].tracker_from_sensor.matrix() - pose.matrix()).cwiseAbs().maxCoeff(), 1e-4);
    }
  }
}

TEST(ForeignFeed, WhatIsNoPoseIsNone) {
  Eigen::Isometry3d scaled = pose_at(1);
  scaled.linear() *= 1.1;
  Eigen::Isometry3d mirrored = pose_at(1);
  mirrored.linear().col(0) *= -1;
  Eigen::Isometry3d nothing = pose_at(1);
  nothing.translation().x() = std::nan("");
  for (const Eigen::Isometry3d& no_pose : {scaled, mirrored, nothing, Eigen::Isometry3d::Identity()}) {
    FeedLink link;
    link.transform("ProbeToTracker", 0, no_pose);
    link.image(0);
    for (const Event& event : link.events(50)) {
      EXPECT_FALSE(std::holds_alternative<Birds>(event));
      const auto* frame = std::get_if<VideoFrame>(&event);
      EXPECT_FALSE(frame != nullptr && frame->info.pose.tracker_from_sensor);
    }
  }
}

TEST(ForeignFeed, DamagedMessagesArePassedOverAndCounted) {
  FeedLink link;
  Bytes wrong = transform_message("ProbeToTracker", FeedLink::at(0), pose_at(1));
  wrong.back() ^= 0x40U;
  link.push(wrong, 0);
  EXPECT_THAT(link.feed.words(), AllOf(HasSubstr("1 damaged"), HasSubstr("\"ProbeToTracker\" has a wrong checksum")));
  // Bodies shorter than what they say of themselves, their checksums right.
  const auto cut = [](const char* type, const Bytes& whole, std::size_t by) {
    return testing::foreign_message(type, "X", FeedLink::at(0),
                                    Bytes(whole.begin() + kHeaderBytes, whole.end() - static_cast<std::ptrdiff_t>(by)));
  };
  const Bytes image = image_message("X", FeedLink::at(0), {}),
              pose = transform_message("X", FeedLink::at(0), pose_at(1));
  link.push(cut("IMAGE", image, 1), 0);
  EXPECT_THAT(link.feed.words(), AllOf(HasSubstr("2 damaged"), HasSubstr("IMAGE \"X\" is cut short")));
  link.push(cut("IMAGE", image, 40), 0);
  link.push(cut("TRANSFORM", pose, 4), 0);
  link.push(cut("TDATA", pose, 0), 0);
  link.push(cut("QTDATA", pose, 0), 0);
  link.push(cut("POSITION", pose, 0), 0);
  Bytes lies = transform_message("X", FeedLink::at(0, 2), pose_at(1));
  lies[kHeaderBytes + 3] = 0xFF;  // of its meta data's index
  link.push(testing::foreign_message("TRANSFORM", "X", {0, 1}, {}), 0);
  lies = testing::foreign_message("TRANSFORM", "X", {0, 1}, Bytes(lies.begin() + kHeaderBytes, lies.end()));
  lies[1] = 2;
  link.push(lies, 0);
  EXPECT_THAT(link.feed.words(), AllOf(HasSubstr("9 damaged"), HasSubstr("extended header that lies")));
  EXPECT_TRUE(link.events(50).empty());
  link.transform("ProbeToTracker", 60, pose_at(1));
  link.image(60);
  const auto frames = link.of<VideoFrame>(70);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].info.pose.kind, PoseKind::exact);
}

TEST(ForeignFeed, WhatTheMetaDataCallInvalidIsNoPose) {
  using MetaData = std::vector<std::pair<std::string, std::string>>;
  // As PLUS sends them (TransformValid, TransformStatus), and Slicer (Status).
  const std::vector<std::pair<MetaData, bool>> cases{
      {{}, true},
      {{{"TransformValid", "True"}, {"TransformStatus", "OK"}}, true},
      {{{"Author", "someone"}}, true},
      {{{"TransformValid", "False"}}, false},
      {{{"TransformValid", "True"}, {"TransformStatus", "OUT_OF_VIEW"}}, false},
      {{{"Status", "MISSING"}}, false},
      {{{"ProbeToTrackerStatus", "INVALID"}}, false},
      {{{"StylusToTrackerStatus", "INVALID"}}, true},
  };
  for (const auto& [meta_data, valid] : cases) {
    FeedLink link;
    for (int i = 0; i < 5; ++i) {
      Envelope envelope = FeedLink::at(20 * i, 2);
      envelope.meta_data = meta_data;
      link.push(transform_message("ProbeToTracker", envelope, pose_at(i)), 20 * i);
    }
    link.image(70);
    const auto frames = link.of<VideoFrame>(200);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(frames[0].info.pose.tracker_from_sensor.has_value(), valid) << ::testing::PrintToString(meta_data);
  }
  // Of a list each element is judged by itself.
  FeedLink link(ForeignSettings{.scope_device = "Probe"});
  for (int i = 0; i < 5; ++i) {
    Bytes list;
    for (const char* name : {"Probe", "Stylus"}) {
      put_text(list, name, 20);
      put_text(list, "", 2);
      put_matrix(list, pose_at(i));
    }
    Envelope envelope = FeedLink::at(20 * i, 2);
    envelope.meta_data = {{"ProbeStatus", "MISSING"}, {"StylusStatus", "OK"}};
    link.push(testing::foreign_message("TDATA", "Tracker", envelope, list), 20 * i);
  }
  for (const Birds& birds : link.of<Birds>(100)) {
    ASSERT_EQ(birds.birds.size(), 1U);
    EXPECT_EQ(birds.birds[0].name, "Stylus");
  }
}

TEST(ForeignFeed, MetaDataThatLieAreDamage) {
  const Bytes whole = transform_message("ProbeToTracker", FeedLink::at(0, 2), pose_at(1));
  const Bytes body(whole.begin() + kHeaderBytes, whole.end());
  // The index: how many, and of the one entry the lengths of key and value.
  for (const auto& [byte, value] : {std::pair{60, 2}, {61, 2}, {62, 1}, {63, 9}, {66, 1}, {69, 3}}) {
    Bytes lies = body;
    lies[static_cast<std::size_t>(byte)] = static_cast<std::uint8_t>(value);
    Bytes message = testing::foreign_message("TRANSFORM", "ProbeToTracker", {kServerNs, 1}, lies);
    message[1] = 2;
    FeedLink link;
    link.push(message, 0);
    EXPECT_THAT(link.feed.words(), HasSubstr("1 damaged")) << byte;
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

TEST(ForeignFeed, DamageAnywhereCrashesNothing) {
  std::mt19937 rng(11);
  const std::vector<Bytes> whole{image_message("Endo", FeedLink::at(0, 2), {}),
                                 transform_message("ProbeToTracker", FeedLink::at(0, 2), pose_at(1)),
                                 image_message("Endo", FeedLink::at(0), {.components = 1})};
  FeedLink link;
  for (int i = 0; i < 20'000; ++i) {
    const Bytes& from = whole[static_cast<std::size_t>(i) % whole.size()];
    Bytes content(from.begin() + kHeaderBytes, from.end());
    for (int hits = 0; hits < 3; ++hits) content[rng() % std::min<std::size_t>(content.size(), 90)] = rng() & 0xFFU;
    content.resize(rng() % 4 == 0 ? rng() % content.size() : content.size());
    Bytes message = testing::foreign_message(std::string_view(reinterpret_cast<const char*>(&from[2])), "Endo",
                                             FeedLink::at(i), content);
    message[1] = from[1];
    link.push(message, i);
    (void)link.events(i);
  }
  EXPECT_THAT(link.feed.words(), HasSubstr("damaged"));
}

TEST(ForeignFeed, VoxelsOf16BitsAreAClearError) {
  FeedLink link;
  link.transform("ProbeToTracker", 0, pose_at(1));
  link.push(image_message("CT_or_US", FeedLink::at(0), {.components = 1, .scalar_type = 5, .scalar_bytes = 2}), 0);
  auto told = link.of<Status>(10);
  ASSERT_EQ(told.size(), 1U);
  EXPECT_FALSE(told[0].ok);
  EXPECT_EQ(told[0].text,
            "IMAGE \"CT_or_US\" has 16-bit voxels of 1 component, and 8-bit grey or RGB is read here: have the server "
            "send that");
  link.push(image_message("CT_or_US", FeedLink::at(20), {}), 20);
  told = link.of<Status>(30);
  ASSERT_EQ(told.size(), 1U) << "it is told that all is well again";
  EXPECT_TRUE(told[0].ok);
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
