// Messages of a server that is no appliance of ours: of all types, without a pose, damaged.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/device/wire/foreign_feed_fixture.hpp"

namespace birdseye::wire {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::put_float;
using testing::put_matrix;
using testing::put_text;

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

TEST(ForeignFeed, APositionThatIsNoPlaceIsNoPose) {
  const float nothing = std::nanf("");
  for (const Eigen::Vector3f& place :
       {Eigen::Vector3f(nothing, 1, 2), Eigen::Vector3f(1, nothing, 2), Eigen::Vector3f(1, 2, nothing),
        Eigen::Vector3f(1, -3e38F, 2), Eigen::Vector3f(nothing, nothing, nothing)}) {
    Bytes position;
    for (const float v : place) put_float(position, v);
    for (const double v : {0.0, 0.6, 0.0, 0.8}) put_float(position, v);
    FeedLink link({.scope_device = "another"});
    link.push(testing::foreign_message("POSITION", "Stylus", FeedLink::at(0, 1), position), 0);
    EXPECT_TRUE(link.of<Birds>(5).empty()) << place.transpose();
  }
}

TEST(ForeignFeed, WhatIsNoPoseIsNone) {
  Eigen::Isometry3d scaled = pose_at(1);
  scaled.linear() *= 1.1;
  Eigen::Isometry3d mirrored = pose_at(1);
  mirrored.linear().col(0) *= -1;
  Eigen::Isometry3d nothing = pose_at(1);
  nothing.translation().x() = std::nan("");
  Eigen::Isometry3d beyond = pose_at(1);
  beyond.translation().y() = 3e38;
  for (const Eigen::Isometry3d& no_pose : {scaled, mirrored, nothing, beyond, Eigen::Isometry3d::Identity()}) {
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

/// Nobody could say which of the two is that tool's. Of the others' poses there is no doubt.
TEST(ForeignFeed, OfAListThatHasANameTwiceTheOthersPosesAreTaken) {
  FeedLink link;
  const auto bird = [](const char* name, double x_mm) {
    const Eigen::Isometry3d pose = pose_at(x_mm);
    return Bird{name, Transform<Tracker, Sensor>(pose.linear(), pose.translation())};
  };
  link.push(pack(Birds{{1}, {bird("Probe", 1), bird("Stylus", 2), bird("Probe", 3)}}).bytes(), 0);
  EXPECT_THAT(link.feed.words(), HasSubstr("\"Probe\", which stands twice in one list"));
  const auto told = link.of<Birds>(10);
  ASSERT_EQ(told.size(), 1U);
  ASSERT_EQ(told[0].birds.size(), 1U);
  EXPECT_EQ(told[0].birds[0].name, "Stylus");
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

}  // namespace
}  // namespace birdseye::wire
