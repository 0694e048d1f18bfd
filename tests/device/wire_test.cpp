#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "device/wire/client.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/server.hpp"
#include "tests/support/wire_messages.hpp"

namespace birdseye::wire {
namespace {

using Clock = std::chrono::steady_clock;
using birdseye::testing::made_plausible;
using birdseye::testing::messages_of;
using std::chrono::seconds;

VideoFrame frame(std::uint64_t sequence, int width = 32, int height = 20) {
  VideoFrame f;
  f.info.sequence = sequence;
  f.info.acquired = {123'456'789'012'345};
  f.info.acquired_sigma = {100};
  f.info.arrived = {123'456'800'000'000};
  f.info.pose.kind = PoseKind::interpolated;
  f.info.pose.tracker_from_sensor =
      Transform<Tracker, Sensor>(rotation_exp(Eigen::Vector3d(0.1, 0.2, -0.3)), Eigen::Vector3d(300, -20, 111));
  f.info.pose.position_sigma_mm = 0.12;
  f.info.pose.age = {-5};
  f.info.frames_dropped = 3;
  f.width_px = width;
  f.height_px = height;
  std::vector<std::uint8_t> rgb(static_cast<std::size_t>(width * height * 3));
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<std::uint8_t>(i * 7 + sequence);
  f.rgb = std::make_shared<const std::vector<std::uint8_t>>(std::move(rgb));
  return f;
}

struct Ends {
  std::unique_ptr<Server> server;
  std::unique_ptr<Client> client;
};

Ends connected() {
  Ends ends;
  ends.server = *Server::listen("127.0.0.1", 0);
  ends.client = *Client::connect("127.0.0.1", ends.server->port(), Clock::now() + seconds(5));
  while (ends.server->clients() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return ends;
}

TEST(Wire, AFrameComesAsItWasSent) {
  const Ends ends = connected();
  const VideoFrame sent = frame(42);
  ends.server->publish(pack(sent));
  const auto event = ends.client->next(Clock::now() + seconds(5));
  ASSERT_TRUE(event && *event);
  const auto& got = std::get<VideoFrame>(**event);
  EXPECT_EQ(got.info.sequence, 42U);
  EXPECT_EQ(got.info.acquired.ns, sent.info.acquired.ns);
  EXPECT_EQ(got.info.arrived.ns, sent.info.arrived.ns);
  EXPECT_EQ(got.info.pose.kind, PoseKind::interpolated);
  EXPECT_EQ(got.info.frames_dropped, 3U);
  EXPECT_LT((got.info.pose.tracker_from_sensor->matrix() - sent.info.pose.tracker_from_sensor->matrix()).norm(), 1e-12);
  EXPECT_EQ(*got.rgb, *sent.rgb);
}

TEST(Wire, ARefusedPoseStaysRefused) {
  const Ends ends = connected();
  VideoFrame sent = frame(1);
  sent.info.pose = {};
  sent.info.pose.reason = "the newest pose is 300 ms old";
  ends.server->publish(pack(sent));
  const auto event = ends.client->next(Clock::now() + seconds(5));
  ASSERT_TRUE(event && *event);
  const PoseAnswer& pose = std::get<VideoFrame>(**event).info.pose;
  EXPECT_EQ(pose.kind, PoseKind::refused);
  EXPECT_FALSE(pose.tracker_from_sensor);
  EXPECT_EQ(pose.reason, sent.info.pose.reason);
}

TEST(Wire, BirdsStatusAndHealth) {
  const Ends ends = connected();
  const Transform<Tracker, Sensor> pose(rotation_exp(Eigen::Vector3d(1, 0.5, 0.25)), Eigen::Vector3d(1, 2, 3));
  ends.server->publish(pack(Birds{{5'000'000'123}, {{"scope", pose}, {"pointer", pose}}}));
  ends.server->publish(pack(Status{false, "the tracker has gone"}, {1}));
  Health health;
  health.tracker_rate_hz = 103.25;
  health.phase_errors = 2;
  ends.server->publish(pack(health, {1}));
  const auto birds = std::get<Birds>(**ends.client->next(Clock::now() + seconds(5)));
  EXPECT_EQ(birds.acquired.ns, 5'000'000'123);
  ASSERT_EQ(birds.birds.size(), 2U);
  EXPECT_EQ(birds.birds[1].name, "pointer");
  EXPECT_LT((birds.birds[0].tracker_from_sensor.matrix() - pose.matrix()).norm(), 1e-6);  // single precision
  const auto status = std::get<Status>(**ends.client->next(Clock::now() + seconds(5)));
  EXPECT_FALSE(status.ok);
  EXPECT_EQ(status.text, "the tracker has gone");
  EXPECT_EQ(std::get<Health>(**ends.client->next(Clock::now() + seconds(5))).phase_errors, 2U);
}

TEST(Wire, AMeasurementWithoutAnyPoseComesEmpty) {
  const Ends ends = connected();
  ends.server->publish(pack(Birds{{7'000'000'000}, {}}));
  const auto event = ends.client->next(Clock::now() + seconds(5));
  ASSERT_TRUE(event) << event.error().what;
  const auto birds = std::get<Birds>(**event);
  EXPECT_EQ(birds.acquired.ns, 7'000'000'000);
  EXPECT_TRUE(birds.birds.empty());
}

TEST(Wire, AClientThatDoesNotReadLosesWholeFramesOnly) {
  const Ends ends = connected();
  for (std::uint64_t i = 0; i < 60; ++i) ends.server->publish(pack(frame(i, 768, 576)));
  std::uint64_t last = 0;
  int frames = 0;
  for (;;) {
    const auto event = ends.client->next(Clock::now() + std::chrono::milliseconds(500));
    ASSERT_TRUE(event) << event.error().what;
    if (!*event) break;
    const auto& got = std::get<VideoFrame>(**event);
    EXPECT_EQ(*got.rgb, *frame(got.info.sequence, 768, 576).rgb);
    EXPECT_TRUE(frames == 0 || got.info.sequence > last);
    last = got.info.sequence;
    ++frames;
  }
  EXPECT_GT(frames, 5);
  EXPECT_EQ(ends.server->messages_shed(), 60U - static_cast<unsigned>(frames));
}

TEST(Wire, TheEndOfTheServerIsSeen) {
  Ends ends = connected();
  ends.server.reset();
  EXPECT_EQ(ends.client->next(Clock::now() + seconds(5)).error().code, Errc::disconnected);
}

TEST(Wire, APortInUseIsNamed) {
  const auto first = Server::listen("127.0.0.1", 0);
  const auto second = Server::listen("127.0.0.1", (*first)->port());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, Errc::in_use);
  EXPECT_NE(second.error().what.find(std::to_string((*first)->port())), std::string::npos);
}

TEST(Wire, NobodyThereIsAnErrorAtTheDeadline) {
  const auto client = Client::connect("127.0.0.1", 1, Clock::now() + std::chrono::milliseconds(100));
  ASSERT_FALSE(client);
  EXPECT_NE(client.error().what.find("127.0.0.1:1"), std::string::npos);
}

TEST(Unpacker, DamageIsRefusedNotBelieved) {
  const Packet packet = pack(Birds{{1}, {{"scope", {}}}});
  for (const std::size_t at : {kHeaderBytes + 3, packet.size() - 1}) {
    std::vector<std::uint8_t> bytes = packet.bytes();
    bytes[at] ^= 0x10;
    EXPECT_FALSE(Unpacker().push(bytes));
  }
}

TEST(Unpacker, LengthsInsideABodyAreNotBelieved) {
  const auto messages = messages_of(pack(frame(1)));
  ASSERT_EQ(messages.size(), 2U);
  const std::vector<std::uint8_t>& info = messages[0];
  std::vector<std::uint8_t> image = messages[1];
  Unpacker sound;
  ASSERT_TRUE(sound.push(made_plausible(info)));
  ASSERT_TRUE(sound.push(made_plausible(image)));

  std::vector<std::uint8_t> longer = info;
  longer[kHeaderBytes + 2] = 0xFF;  // the text's length
  EXPECT_FALSE(Unpacker().push(made_plausible(longer)));

  // Pixels left away, and the body's length with them; the width and height still promise them.
  image.resize(image.size() - 1000);
  Unpacker unpacker;
  ASSERT_TRUE(unpacker.push(info));
  EXPECT_FALSE(unpacker.push(made_plausible(image)));
}

TEST(Unpacker, AHeaderMayNotAskForMoreThanTheLargestBody) {
  std::vector<std::uint8_t> header(kHeaderBytes);
  header[1] = 1;
  header[2] = 'X';
  header[44] = 0x7F;
  EXPECT_FALSE(body_bytes(header));
  header[44] = 0;
  header[49] = 12;
  EXPECT_EQ(*body_bytes(header), 12U);
  header[1] = 9;
  EXPECT_FALSE(body_bytes(header));
}

}  // namespace
}  // namespace birdseye::wire
