// Messages that are whole, and say what no appliance says.

#include "device/wire/unpacker.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

#include "device/wire/json.hpp"
#include "tests/support/wire_messages.hpp"

namespace birdseye::wire {
namespace {

using birdseye::testing::messages_of;

VideoFrame frame_at(DeviceTime acquired) {
  VideoFrame frame;
  frame.info.acquired = acquired;
  frame.info.acquired_sigma = {100};
  frame.info.pose.kind = PoseKind::predicted;
  frame.info.pose.age = {5};
  frame.info.pose.tracker_from_sensor = Transform<Tracker, Sensor>();
  frame.width_px = 4;
  frame.height_px = 2;
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(4 * 2 * 3);
  return frame;
}

constexpr DeviceTime kSome{123'456'789'012'345};

TEST(Unpacker, ATdataThatHasANameTwiceIsRefused) {
  const auto pushed = [](const Birds& birds) { return Unpacker().push(pack(birds).bytes()).has_value(); };
  EXPECT_TRUE(pushed(Birds{{1}, {{"scope", {}}, {"table-reference-left", {}}}}));
  EXPECT_FALSE(pushed(Birds{{1}, {{"scope", {}}, {"scope", {}}}}));
  // Of this name only what it shares with the other fits into the message.
  EXPECT_FALSE(pushed(Birds{{1}, {{"table-reference-left-hand-pointer", {}}, {"table-reference-left", {}}}}));
}

TEST(Unpacker, AnImageOfAnotherTimeThanItsFrameInfoIsRefused) {
  const auto sent = messages_of(pack(frame_at(kSome)));
  const auto later = messages_of(pack(frame_at(kSome + Duration{1})));
  Unpacker unpacker;
  ASSERT_TRUE(unpacker.push(sent[0]));
  EXPECT_FALSE(unpacker.push(later[1]));
  ASSERT_TRUE(unpacker.push(later[0]));
  EXPECT_TRUE(unpacker.push(later[1]));
}

TEST(FrameInfo, WhatCannotBeBelowZeroIsRefusedThere) {
  const nlohmann::json sound = frame_at(kSome).info;
  EXPECT_NO_THROW((void)sound.get<FrameInfo>());
  for (const char* place :
       {"/acquired_sigma_ns", "/pose/sigma_mm", "/pose/time_sigma_ns", "/pose/speed_mm_s", "/pose/age_ns"}) {
    nlohmann::json wrong = sound;
    wrong[nlohmann::json::json_pointer(place)] = -1;
    EXPECT_THROW((void)wrong.get<FrameInfo>(), nlohmann::json::exception) << place;
  }
  for (const char* place : {"/pose/sigma_mm", "/pose/speed_mm_s"}) {
    nlohmann::json wrong = sound;
    wrong[nlohmann::json::json_pointer(place)] = std::numeric_limits<double>::infinity();
    EXPECT_THROW((void)wrong.get<FrameInfo>(), nlohmann::json::exception) << place;
  }
  WallClock clock;
  clock.max_error_ns = -1;
  const nlohmann::json wrong = clock;
  EXPECT_THROW((void)wrong.get<WallClock>(), nlohmann::json::exception);
}

}  // namespace
}  // namespace birdseye::wire
