#include <gtest/gtest.h>
#include <igtlStringMessage.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "device/wire/client.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/json.hpp"
#include "device/wire/server.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/wire_messages.hpp"

namespace birdseye::wire {
namespace {

using birdseye::testing::made_plausible;
using birdseye::testing::messages_of;

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
  ends.client = *Client::connect("127.0.0.1", ends.server->port(), Deadline::after(Duration::from_ms(5000)));
  while (ends.server->clients() == 0) sleep_for(Duration::from_ms(1));
  return ends;
}

TEST(Wire, AFrameComesAsItWasSent) {
  const Ends ends = connected();
  const VideoFrame sent = frame(42);
  ends.server->publish(pack(sent));
  const auto event = ends.client->next(Deadline::after(Duration::from_ms(5000)));
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
  const auto event = ends.client->next(Deadline::after(Duration::from_ms(5000)));
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
  const auto birds = std::get<Birds>(**ends.client->next(Deadline::after(Duration::from_ms(5000))));
  EXPECT_EQ(birds.acquired.ns, 5'000'000'123);
  ASSERT_EQ(birds.birds.size(), 2U);
  EXPECT_EQ(birds.birds[1].name, "pointer");
  EXPECT_LT((birds.birds[0].tracker_from_sensor.matrix() - pose.matrix()).norm(), 1e-6);  // single precision
  const auto status = std::get<Status>(**ends.client->next(Deadline::after(Duration::from_ms(5000))));
  EXPECT_FALSE(status.ok);
  EXPECT_EQ(status.text, "the tracker has gone");
  EXPECT_EQ(std::get<Health>(**ends.client->next(Deadline::after(Duration::from_ms(5000)))).phase_errors, 2U);
}

/// A card's name, cut inside a character as a driver cuts it.
TEST(Wire, WhatAnInstrumentSaysInAnotherEncodingIsSentAllTheSame) {
  const Ends ends = connected();
  Health health;
  health.instruments = {{"camera", "running", "Endoskop f\xFCr \xC3", 0, {{"card", "Endoskop f\xFCr \xC3"}}}};
  ends.server->publish(pack(health, {1}));
  const auto told = std::get<Health>(**ends.client->next(Deadline::after(Duration::from_ms(5000))));
  EXPECT_EQ(told.instruments.at(0).identity.at("card"), "Endoskop f\uFFFDr \uFFFD");
}

/// What is packed by hand, against the library that others unpack it with.
TEST(Wire, AStringIsToTheByteAsTheLibraryPacksIt) {
  for (const std::size_t size : {0U, 1U, 300U, 20000U}) {
    const Doubt doubt{{1'234'567'890'123}, "scope", std::string(size, 'x') + "\u00e9"};
    const auto message = igtl::StringMessage::New();
    message->SetDeviceName(kDoubtDevice);
    const std::uint64_t stamp = stamp_from(doubt.acquired);
    message->SetTimeStamp(static_cast<unsigned>(stamp >> 32U), static_cast<unsigned>(stamp & 0xFFFFFFFFU));
    message->SetString(text_of(doubt).c_str());
    message->Pack();
    const auto* bytes = static_cast<const std::uint8_t*>(message->GetPackPointer());
    EXPECT_EQ(pack(doubt).bytes(), std::vector<std::uint8_t>(bytes, bytes + message->GetPackSize())) << size;
  }
}

TEST(Wire, ATransformIsNamedByItsBirdWithinWhatTheProtocolHasRoomFor) {
  EXPECT_EQ(transform_device("scope"), "ScopeToTracker");
  EXPECT_EQ(transform_device("bird2"), "Bird2ToTracker");
  EXPECT_EQ(transform_device("Stylus"), "StylusToTracker");
  EXPECT_EQ(transform_device("laparoscope_left"), "LaparoscopeToTracker");
  EXPECT_EQ(transform_device("0123456789\u00e9"), "0123456789ToTracker");  // its last letter has two bytes
}

TEST(Wire, TransformsWaitAndGoWithTheirTdata) {
  const auto plain = pack(Birds{{5}, {{"scope", {}}, {"pointer", {}}}});
  const auto both = pack(Birds{{5}, {{"scope", {}}, {"pointer", {}}}}, {}, true);
  constexpr std::size_t kTransformBytes = 58 + 48;
  EXPECT_EQ(both.size(), plain.size() + 2 * kTransformBytes);
  EXPECT_EQ(both.kind, Packet::Kind::tracking);
  EXPECT_TRUE(std::equal(plain.head->begin(), plain.head->end(), both.head->begin()));
}

TEST(Wire, AMeasurementWithoutAnyPoseComesEmpty) {
  const Ends ends = connected();
  ends.server->publish(pack(Birds{{7'000'000'000}, {}}));
  const auto event = ends.client->next(Deadline::after(Duration::from_ms(5000)));
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
    const auto event = ends.client->next(Deadline::after(Duration::from_ms(500)));
    ASSERT_TRUE(event) << event.error().what;
    if (!*event) break;
    const auto& got = std::get<VideoFrame>(**event);
    EXPECT_EQ(*got.rgb, *frame(got.info.sequence, 768, 576).rgb);
    EXPECT_TRUE(frames == 0 || got.info.sequence > last);
    last = got.info.sequence;
    ++frames;
  }
  EXPECT_EQ(last, 59U);  // the newest is never the one that is lost
  EXPECT_EQ(ends.server->take_counters().messages_shed, 60U - static_cast<unsigned>(frames));
}

/// A client's end at the server, and the client's.
struct Served {
  Served() {
    int fds[2];
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, fds), 0);
    link.emplace(link_over(UniqueFd(fds[0])));
    server_fd = fds[0];
    fd = fds[1];
  }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;
  ~Served() { ::close(fd); }
  /// Sends and reads until nothing is left: the messages, as the client understands them.
  std::vector<Event> drain() {
    std::vector<std::uint8_t> bytes(1U << 20U), all;
    for (ssize_t got = 0; got > 0 || link->wants_to_write();) {
      EXPECT_TRUE(link->send_some(latencies));
      got = ::recv(fd, bytes.data(), bytes.size(), 0);
      if (got > 0) all.insert(all.end(), bytes.begin(), bytes.begin() + got);
    }
    std::vector<Event> events;
    for (std::size_t from = 0; from < all.size();) {
      const auto rest = std::span(all).subspan(from);
      const std::size_t size = kHeaderBytes + static_cast<std::size_t>(*body_bytes(rest));
      const auto told = unpacker.push(rest.first(size));
      EXPECT_TRUE(told);
      if (told && *told && std::holds_alternative<Event>(**told)) events.push_back(std::get<Event>(**told));
      from += size;
    }
    return events;
  }
  /// Sends until the client's socket takes no more.
  void fill() {
    for (int i = 0; i < 50; ++i) EXPECT_TRUE(link->send_some(latencies));
  }
  std::size_t offer(const Packet& packet) { return link->offer(packet); }

  std::optional<ClientLink> link;
  int server_fd = -1;  // the link's own
  int fd = -1;
  Latencies latencies;
  Unpacker unpacker;
};

std::vector<std::uint64_t> sequences_of(const std::vector<Event>& events) {
  std::vector<std::uint64_t> sequences;
  for (const Event& event : events) {
    if (const auto* got = std::get_if<VideoFrame>(&event)) sequences.push_back(got->info.sequence);
  }
  return sequences;
}

TEST(ClientLink, ASlowClientGetsTheFrameThatHasBegunAndThenTheNewest) {
  Served link;
  VideoFrame large = frame(0, 1024, 768);
  link.offer(pack(large));
  link.fill();
  std::size_t shed = 0;
  for (large.info.sequence = 1; large.info.sequence < 100; ++large.info.sequence) {
    shed += link.offer(pack(large));
    EXPECT_TRUE(link.link->send_some(link.latencies));
  }
  EXPECT_EQ(shed, 96U);
  EXPECT_EQ(sequences_of(link.drain()), (std::vector<std::uint64_t>{0, 97, 98, 99}));
}

TEST(ClientLink, AFrameOfWhichNothingWasTakenHasNotBegun) {
  Served link;
  const std::vector<std::uint8_t> junk(1U << 16U);
  while (::send(link.server_fd, junk.data(), junk.size(), MSG_NOSIGNAL) > 0) {
  }
  for (std::uint64_t i = 0; i < 10; ++i) {
    link.offer(pack(frame(i)));
    EXPECT_TRUE(link.link->send_some(link.latencies));
  }
  link.offer(pack(Status{true, "first"}, {1}));
  std::vector<std::uint8_t> bytes(1U << 20U);
  while (::recv(link.fd, bytes.data(), bytes.size(), 0) > 0) {
  }
  const auto events = link.drain();
  ASSERT_EQ(events.size(), 4U);
  EXPECT_TRUE(std::holds_alternative<Status>(events[0]));
  EXPECT_EQ(sequences_of(events), (std::vector<std::uint64_t>{7, 8, 9}));
}

TEST(ClientLink, PosesPushOutOlderPosesAndNothingElse) {
  Served link;
  link.offer(pack(frame(0, 1024, 768)));
  link.fill();
  link.offer(pack(Pedal{true, {5}}));
  link.offer(pack(Status{false, "old"}, {1}));
  std::size_t shed = 0;
  for (int i = 0; i < 10'000; ++i) shed += link.offer(pack(Birds{{i}, {{"scope", {}}}}));
  EXPECT_EQ(shed, 10'000 - PacketQueue::kMostOfAKind);
  EXPECT_EQ(link.offer(pack(Status{false, "new"}, {2})), 0U);
  EXPECT_EQ(link.offer(pack(Pedal{false, {6}})), 0U);
  std::vector<std::int64_t> acquired, pedals;
  std::vector<std::string> statuses;
  for (const Event& event : link.drain()) {
    if (const auto* birds = std::get_if<Birds>(&event)) acquired.push_back(birds->acquired.ns);
    if (const auto* pedal = std::get_if<Pedal>(&event)) pedals.push_back(pedal->at.ns);
    if (const auto* status = std::get_if<Status>(&event)) statuses.push_back(status->text);
  }
  ASSERT_EQ(acquired.size(), PacketQueue::kMostOfAKind);
  EXPECT_NEAR(static_cast<double>(acquired.front()), 10'000.0 - PacketQueue::kMostOfAKind, 1);  // as stamps round
  EXPECT_TRUE(std::ranges::is_sorted(acquired));
  EXPECT_EQ(pedals, (std::vector<std::int64_t>{5, 6}));
  EXPECT_EQ(statuses, (std::vector<std::string>{"new"}));
}

TEST(ClientLink, WhatAnswersIsBoundedToo) {
  Served link;
  link.offer(pack(frame(0, 1024, 768)));
  link.fill();
  std::size_t shed = 0;
  for (int i = 0; i < 1000; ++i) shed += link.offer(pack_tracking_reply(true));
  EXPECT_EQ(shed, 1000 - PacketQueue::kMostOfAKind);
  EXPECT_EQ(link.offer(pack(Status{true, "still told"}, {1})), 0U);
  bool told = false;
  for (const Event& event : link.drain()) told = told || std::holds_alternative<Status>(event);
  EXPECT_TRUE(told);
}

TEST(Wire, WhatAnOlderApplianceDoesNotCountIsNought) {
  Health health;
  health.clients_shed = 4;
  auto json = nlohmann::json(health);
  EXPECT_EQ(json.get<Health>().clients_shed, 4U);
  json.erase("clients_shed");
  health = json.get<Health>();
  EXPECT_EQ(health.clients_shed, 0U);
}

TEST(Wire, TheEndOfTheServerIsSeen) {
  Ends ends = connected();
  ends.server.reset();
  EXPECT_EQ(ends.client->next(Deadline::after(Duration::from_ms(5000))).error().code, Errc::disconnected);
}

TEST(Wire, APortInUseIsNamed) {
  const auto first = Server::listen("127.0.0.1", 0);
  const auto second = Server::listen("127.0.0.1", (*first)->port());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, Errc::in_use);
  EXPECT_NE(second.error().what.find(std::to_string((*first)->port())), std::string::npos);
}

TEST(Wire, NobodyThereIsAnErrorAtTheDeadline) {
  const auto client = Client::connect("127.0.0.1", 1, Deadline::after(Duration::from_ms(100)));
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
