// Our client at a server of the protocol's own library.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>

#include "device/wire/client.hpp"
#include "drivers/system/clock.hpp"
#include "tests/support/foreign_server.hpp"
#include "tests/support/plus_server.hpp"

namespace birdseye::wire {
namespace {

using testing::ForeignServer;
using ::testing::HasSubstr;

/// Frames until there are so many, or there are none for too long.
std::vector<VideoFrame> frames_from(Client& client, std::size_t count) {
  std::vector<VideoFrame> frames;
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  while (frames.size() < count && !deadline.passed()) {
    const auto event = client.next(deadline);
    if (!event) break;
    if (const auto* frame = *event ? std::get_if<VideoFrame>(&**event) : nullptr) frames.push_back(*frame);
  }
  return frames;
}

TEST(ForeignServer, ItsVideoHasThePosesOfItsStamps) {
  ForeignServer server;
  const auto client = *Client::connect("127.0.0.1", server.port(), Deadline::after(Duration::from_ms(5000)));
  const auto frames = frames_from(*client, 30);
  ASSERT_EQ(frames.size(), 30U);
  int exact = 0;
  for (const VideoFrame& frame : frames) {
    EXPECT_EQ(frame.width_px, 64);
    EXPECT_EQ(frame.height_px, 48);
    ASSERT_TRUE(frame.info.pose.tracker_from_sensor) << frame.info.pose.reason;
    exact += frame.info.pose.kind == PoseKind::exact ? 1 : 0;
    const double at_s = static_cast<double>(frame.info.acquired.ns) * 1e-9;
    const Eigen::Matrix4d error = frame.info.pose.tracker_from_sensor->matrix() - ForeignServer::pose_at(at_s).matrix();
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-3);
  }
  EXPECT_GT(exact, 15) << "a server that was halted between a picture and its pose may give some others";
  // Nothing asks it for the time; it is on this machine, so that the time of day relates its stamps.
  const auto related = client->host_from_device(frames.back().info.acquired);
  ASSERT_TRUE(related);
  const std::int64_t truth_ns = frames.back().info.acquired.ns - wall_minus_monotonic().ns;
  const Duration error{related->time.ns - truth_ns};
  EXPECT_LE(error, Duration::from_ms(0)) << "a frame is never taken for newer than it is";
  EXPECT_GE(error, Duration::from_ms(-60));
  EXPECT_GE(related->sigma, Duration::from_ms(20));
  EXPECT_EQ(client->peer_words(), "an OpenIGTLink server that is no appliance of Birdseye; passed over: STRING");
  EXPECT_TRUE(server.was_asked("STT_TDATA")) << "some send poses by TDATA to those only who ask";
  EXPECT_FALSE(server.was_asked("STRING")) << "what only an appliance can answer is not asked";
}

/// One that only listens: it is asked, though the caller waits for it in one piece.
TEST(ForeignServer, ASilentOneIsAskedWithinOneLongWait) {
  const int listening = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(listening, reinterpret_cast<sockaddr*>(&address), size), 0);
  ASSERT_EQ(::listen(listening, 1), 0);
  ASSERT_EQ(::getsockname(listening, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const auto client = *Client::connect("127.0.0.1", ntohs(address.sin_port), Deadline::after(Duration::from_ms(5000)));
  const auto event = client->next(Deadline::after(Duration::from_ms(2500)));
  ASSERT_TRUE(event) << event.error().what;
  EXPECT_FALSE(*event);
  const int peer = ::accept(listening, nullptr, nullptr);
  std::string asked;
  std::array<char, 4096> bytes{};
  ssize_t got = 0;
  while ((got = ::recv(peer, bytes.data(), bytes.size(), MSG_DONTWAIT)) > 0)
    asked.append(bytes.data(), static_cast<std::size_t>(got));
  EXPECT_THAT(asked, HasSubstr("STRING")) << "the time";
  EXPECT_THAT(asked, HasSubstr("STT_TDATA")) << "poses";
  EXPECT_THAT(asked, HasSubstr("GET_STATUS")) << "by which it learns that headers of version 2 are read";
  ::close(peer);
  ::close(listening);
}

TEST(ForeignServer, TheScopeIsChosenByName) {
  ForeignServer server(true);
  const auto client = *Client::connect("127.0.0.1", server.port(), Deadline::after(Duration::from_ms(5000)),
                                       {"StylusToTracker", "", "scope"});
  const auto frames = frames_from(*client, 5);
  ASSERT_EQ(frames.size(), 5U);
  const double at_s = static_cast<double>(frames.back().info.acquired.ns) * 1e-9;
  ASSERT_TRUE(frames.back().info.pose.tracker_from_sensor);
  const Eigen::Matrix4d error =
      frames.back().info.pose.tracker_from_sensor->matrix() - ForeignServer::pose_at(at_s).inverse().matrix();
  EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-3);
}

TEST(PlusServer, ItsFramesHaveThePosesOfTheTransformThatIsNamed) {
  testing::PlusServer server;
  const auto client = *Client::connect("127.0.0.1", server.port(), Deadline::after(Duration::from_ms(5000)),
                                       {"ProbeToTracker", "Image_Reference", "StylusToTracker"});
  const auto frames = frames_from(*client, 60);
  ASSERT_EQ(frames.size(), 60U);
  for (const VideoFrame& frame : frames) {
    EXPECT_EQ(frame.width_px, 64);
    ASSERT_TRUE(frame.info.pose.tracker_from_sensor) << frame.info.pose.reason;
    const double at_s = static_cast<double>(frame.info.acquired.ns) * 1e-9;
    const Eigen::Matrix4d error =
        frame.info.pose.tracker_from_sensor->matrix() - testing::PlusServer::pose_at(at_s).matrix();
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.05);  // 30 mm/s where a pose is predicted by a moment
  }
  EXPECT_GE(server.version(), 2U) << "else it would not say which poses are valid";
  EXPECT_EQ(client->peer_words(), "an OpenIGTLink server that is no appliance of Birdseye; passed over: STRING");
  // Its clock is an hour ahead of the time of day here.
  const auto related = client->host_from_device(frames.back().info.acquired);
  ASSERT_TRUE(related);
  const Duration ahead = Duration::from_ms(static_cast<std::int64_t>(testing::PlusServer::kAhead_s * 1e3));
  const std::int64_t truth_ns = frames.back().info.acquired.ns - ahead.ns - wall_minus_monotonic().ns;
  EXPECT_LE(std::abs(related->time.ns - truth_ns), Duration::from_ms(60).ns);
}

TEST(PlusServer, AToolOutOfViewHasNoPoseThoughItsLastMatrixComes) {
  testing::PlusServer server;
  const auto client = *Client::connect("127.0.0.1", server.port(), Deadline::after(Duration::from_ms(5000)),
                                       {"ProbeToTracker", "Image_Reference", "StylusToTracker"});
  ASSERT_EQ(frames_from(*client, 50).size(), 50U);  // by then it has been asked
  ASSERT_GE(server.version(), 2U);
  server.lose_probe();
  // A prediction bridges a moment; what comes thereafter is the last matrix again and again, and no pose.
  const auto frames = frames_from(*client, 20);
  ASSERT_EQ(frames.size(), 20U);
  for (std::size_t i = 10; i < frames.size(); ++i) EXPECT_FALSE(frames[i].info.pose.tracker_from_sensor) << i;
}

TEST(PlusServer, WhatOnlyKeepsTheConnectionAliveIsNoVideoAndNoDamage) {
  testing::PlusServer server;
  server.go_idle();
  const auto client = *Client::connect("127.0.0.1", server.port(), Deadline::after(Duration::from_ms(5000)));
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  std::string told;
  while (told.empty() && !deadline.passed()) {
    const auto event = client->next(deadline);
    ASSERT_TRUE(event) << event.error().what;
    if (const auto* status = *event ? std::get_if<Status>(&**event) : nullptr) told = status->text;
  }
  EXPECT_EQ(told, "the server sends neither video nor poses");
  EXPECT_EQ(client->peer_words(), "an OpenIGTLink server that is no appliance of Birdseye");
}

TEST(ForeignServer, OneThatEndsInTheMiddleOfAMessageHasGone) {
  ForeignServer server;
  const auto client = *Client::connect("127.0.0.1", server.port(), Deadline::after(Duration::from_ms(5000)));
  ASSERT_EQ(frames_from(*client, 2).size(), 2U);
  server.cut_off();
  const auto deadline = Deadline::after(Duration::from_ms(10'000));
  for (;;) {
    const auto event = client->next(deadline);
    ASSERT_FALSE(deadline.passed());
    if (event) continue;
    EXPECT_EQ(event.error().code, Errc::disconnected);
    EXPECT_THAT(event.error().what, HasSubstr("the server has gone"));
    break;
  }
}

}  // namespace
}  // namespace birdseye::wire
