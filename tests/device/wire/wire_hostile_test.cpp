// What nobody sane would send: every message damaged in every way that seeds can think of, at both ends of the wire.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>

#include "device/wire/client.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/server.hpp"
#include "drivers/system/wait.hpp"
#include "tests/support/wire_messages.hpp"

namespace birdseye::wire {
namespace {

using birdseye::testing::made_plausible;
using birdseye::testing::messages_of;
using Bytes = std::vector<std::uint8_t>;

constexpr std::size_t kTypeAt = 2, kDeviceAt = 14;

/// One of every kind that the appliance sends, each a whole message of its own.
std::vector<Bytes> one_of_each() {
  VideoFrame frame;
  frame.info.sequence = 7;
  frame.info.pose.kind = PoseKind::interpolated;
  frame.info.pose.tracker_from_sensor = Transform<Tracker, Sensor>();
  frame.width_px = 16;
  frame.height_px = 8;
  frame.rgb = std::make_shared<const Bytes>(16 * 8 * 3, std::uint8_t{50});
  const std::vector<Packet> packets{pack(frame), pack(Birds{{5}, {{"scope", {}}, {"pointer", {}}}}),
                                    pack(Status{false, "the camera has gone"}, {5}), pack(Health{}, {5})};
  std::vector<Bytes> messages;
  for (const Packet& packet : packets) {
    for (Bytes& message : messages_of(packet)) messages.push_back(std::move(message));
  }
  return messages;
}

/// A place in the message, more often one where lengths and counts live.
std::size_t some_place(std::mt19937& random, std::size_t size) {
  std::size_t reach = size;
  if (random() % 2 == 0) reach = std::min<std::size_t>(size, kHeaderBytes + 80);
  return random() % reach;
}

Bytes damaged(Bytes message, std::mt19937& random) {
  constexpr std::array<std::uint8_t, 6> kTelling{0x00, 0x01, 0x7F, 0x80, 0xFE, 0xFF};
  const auto rounds = 1 + random() % 4;
  for (std::size_t i = 0; i < rounds && !message.empty(); ++i) {
    const std::size_t at = some_place(random, message.size());
    switch (random() % 6) {
      case 0:
        message[at] = static_cast<std::uint8_t>(random());
        break;
      case 1:
        message[at] ^= static_cast<std::uint8_t>(1U << random() % 8U);
        break;
      case 2:
        message[at] = kTelling[random() % kTelling.size()];
        break;
      case 3:
        message.resize(at);
        break;
      case 4:
        message.insert(message.end(), random() % 300, static_cast<std::uint8_t>(random()));
        break;
      default:
        message.erase(message.begin() + static_cast<std::ptrdiff_t>(at));
    }
  }
  return message;
}

/// What is believed must make sense, whatever the bytes were.
void expect_sane(const Event& event) {
  if (const auto* frame = std::get_if<VideoFrame>(&event)) {
    EXPECT_EQ(frame->rgb->size(),
              static_cast<std::size_t>(frame->width_px) * static_cast<std::size_t>(frame->height_px) * 3);
    const auto& pose = frame->info.pose;
    EXPECT_EQ(pose.kind == PoseKind::refused, !pose.tracker_from_sensor.has_value());
    if (pose.tracker_from_sensor) {
      EXPECT_TRUE(pose.tracker_from_sensor->matrix().allFinite());
    }
  }
  if (const auto* birds = std::get_if<Birds>(&event)) {
    for (const Bird& bird : birds->birds) {
      const Eigen::Matrix4d m = bird.tracker_from_sensor.matrix();
      const Eigen::Matrix3d r = m.topLeftCorner<3, 3>();
      EXPECT_TRUE(m.allFinite()) << bird.name;
      EXPECT_TRUE((r * r.transpose()).isIdentity(1e-6)) << bird.name << "\n" << m;
    }
  }
}

TEST(WireHostile, DamageWithAWrongChecksumIsNeverBelieved) {
  std::mt19937 random(20261121);
  for (const Bytes& sound : one_of_each()) {
    Unpacker unpacker;
    (void)unpacker.push(one_of_each()[0]);  // a FrameInfo, so that an image would be believed
    for (int i = 0; i < 2000; ++i) {
      Bytes message = sound;
      message[kHeaderBytes + random() % (message.size() - kHeaderBytes)] ^=
          static_cast<std::uint8_t>(1 + random() % 255);
      EXPECT_FALSE(unpacker.push(message));
    }
  }
}

TEST(WireHostile, ACutMessageIsRefused) {
  for (const Bytes& sound : one_of_each()) {
    for (std::size_t size = 0; size < sound.size(); ++size) {
      const auto event = Unpacker().push(std::span(sound).first(size));
      EXPECT_FALSE(event && *event) << size;
    }
  }
}

TEST(WireHostile, WithARightChecksumTheBodyIsStillNotTrusted) {
  std::mt19937 random(7);
  const std::vector<Bytes> each = one_of_each();
  int believed = 0;
  for (int i = 0; i < 20'000; ++i) {
    Unpacker unpacker;
    if (random() % 2 == 0) (void)unpacker.push(each[0]);
    Bytes message = damaged(each[random() % each.size()], random);
    if (message.size() < kHeaderBytes) continue;
    const auto event = unpacker.push(made_plausible(std::move(message)));
    if (!event || !*event) continue;
    ++believed;
    expect_sane(std::get<Event>(**event));
  }
  EXPECT_GT(believed, 100);  // else it was the header alone that was tried
}

TEST(WireHostile, AnotherKindsBodyUnderOurNames) {
  const std::vector<Bytes> each = one_of_each();
  for (const Bytes& name : each) {
    for (const Bytes& body : each) {
      Bytes message(name.begin(), name.begin() + kHeaderBytes);
      message.insert(message.end(), body.begin() + kHeaderBytes, body.end());
      Unpacker unpacker;
      (void)unpacker.push(each[0]);
      const auto event = unpacker.push(made_plausible(message));
      if (event && *event) expect_sane(std::get<Event>(**event));
    }
  }
}

TEST(WireHostile, AHeaderNeverPromisesMoreThanTheLargestBody) {
  std::mt19937 random(11);
  const Bytes sound = one_of_each()[0];
  for (int i = 0; i < 100'000; ++i) {
    Bytes header(sound.begin(), sound.begin() + kHeaderBytes);
    for (std::uint64_t n = 1 + random() % 8; n > 0; --n)
      header[random() % kHeaderBytes] = static_cast<std::uint8_t>(random());
    if (const auto size = body_bytes(header)) {
      EXPECT_LE(*size, kLargestBody);
    }
  }
  EXPECT_FALSE(body_bytes(std::span(sound).first(kHeaderBytes - 1)));
}

/// A socket to, or of, the other end: what is written there is up to the test.
class Raw {
 public:
  static Raw connected_to(int port, int receive_buffer_bytes = 0) {
    Raw raw(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    if (receive_buffer_bytes > 0)
      ::setsockopt(raw.fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
    sockaddr_in address = loopback(port);
    EXPECT_EQ(::connect(raw.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return raw;
  }
  static Raw listening(int& port) {
    Raw raw(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
    sockaddr_in address = loopback(0);
    socklen_t size = sizeof address;
    EXPECT_EQ(::bind(raw.fd_, reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(raw.fd_, 1), 0);
    EXPECT_EQ(::getsockname(raw.fd_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port = ntohs(address.sin_port);
    return raw;
  }
  [[nodiscard]] Raw accepted() const { return Raw(::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC)); }
  void send(const Bytes& bytes) const { (void)!::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT); }
  /// Waits for the first byte of something.
  [[nodiscard]] bool hears(Duration most) const { return peek(most) > 0; }
  [[nodiscard]] bool ends(Duration most) const { return peek(most) == 0; }
  Raw(Raw&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Raw& operator=(Raw&&) = delete;
  ~Raw() {
    if (fd_ >= 0) ::close(fd_);
  }

 private:
  explicit Raw(int fd) : fd_(fd) {}
  [[nodiscard]] ssize_t peek(Duration most) const {
    const timeval limit{most.ns / 1'000'000'000, most.ns % 1'000'000'000 / 1000};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    std::uint8_t byte = 0;
    return ::recv(fd_, &byte, 1, MSG_PEEK);
  }
  static sockaddr_in loopback(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return address;
  }
  int fd_;
};

TEST(WireHostile, AClientRefusesABadServerAndDoesNotHang) {
  std::mt19937 random(13);
  const std::vector<Bytes> each = one_of_each();
  int port = 0;
  const Raw listener = Raw::listening(port);
  for (int i = 0; i < 200; ++i) {
    const auto client = Client::connect("127.0.0.1", port, Deadline::after(Duration::from_ms(5000)));
    ASSERT_TRUE(client);
    {
      const Raw server = listener.accepted();
      for (int n = 0; n < 4; ++n) server.send(damaged(each[random() % each.size()], random));
    }
    // Each answer is an event or an error; the server has gone, so an error must come within a few.
    int events = 0;
    for (;; ++events) {
      ASSERT_LT(events, 10);
      const auto event = (*client)->next(Deadline::after(Duration::from_ms(20'000)));
      if (!event) break;
      ASSERT_TRUE(*event);
      expect_sane(**event);
    }
  }
}

TEST(WireHostile, AServerOutlivesBadClientsAndServesTheGoodOne) {
  const auto server = *Server::listen("127.0.0.1", 0);
  const auto good = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  std::mt19937 random(17);
  std::vector<Bytes> each = one_of_each();
  // What asks: names that a server may know, with bodies that they should not have.
  for (const char* type :
       {"STT_TDATA", "STP_TDATA", "GET_STATUS", "GET_CAPABIL", "GET_IMAGE", "STT_QTDATA", "TIMESYNC"}) {
    Bytes request(kHeaderBytes + 36, 0);
    request[1] = 1;
    std::copy_n(type, std::string_view(type).size(), request.begin() + kTypeAt);
    request[kDeviceAt] = 'x';
    each.push_back(made_plausible(request));
  }
  for (int i = 0; i < 150; ++i) {
    const Raw bad = Raw::connected_to(server->port());
    for (int n = 0; n < 6; ++n) {
      Bytes message = damaged(each[random() % each.size()], random);
      if (message.size() >= kHeaderBytes && random() % 2 == 0) message = made_plausible(std::move(message));
      bad.send(message);
    }
    if (i % 10 != 0) continue;
    // The good one is told something new each time; what else came to it is passed over.
    const std::string text = "round " + std::to_string(i);
    const auto deadline = Deadline::after(Duration::from_ms(20'000));
    bool heard = false;
    while (!heard && !deadline.passed()) {
      server->publish(pack(Status{true, text}, {i}));
      const auto event = good->next(Deadline::after(Duration::from_ms(100)));
      ASSERT_TRUE(event) << event.error().what;
      if (!*event) continue;
      const auto* status = std::get_if<Status>(&**event);
      heard = status != nullptr && status->text == text;
    }
    EXPECT_TRUE(heard) << text;
  }
}

/// Frames of a size, each with pixels of its own, and how many bytes of them somebody still holds.
class Video {
 public:
  Video(int width_px, int height_px) : width_px_(width_px), height_px_(height_px) {}
  Packet next() {
    VideoFrame frame;
    frame.info.sequence = pixels_.size();
    frame.width_px = width_px_;
    frame.height_px = height_px_;
    frame.rgb = std::make_shared<const Bytes>(static_cast<std::size_t>(width_px_ * height_px_) * 3, std::uint8_t{50});
    pixels_.push_back(frame.rgb);
    return pack(frame);
  }
  [[nodiscard]] std::size_t bytes_held() const {
    std::size_t bytes = 0;
    for (const auto& pixels : pixels_) {
      if (const auto held = pixels.lock()) bytes += held->size();
    }
    return bytes;
  }

 private:
  int width_px_, height_px_;
  std::vector<std::weak_ptr<const Bytes>> pixels_;
};

/// A client that the server knows of already.
Raw taken_by(const Server& server, int receive_buffer_bytes = 0) {
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  const auto before = server.clients();
  Raw raw = Raw::connected_to(server.port(), receive_buffer_bytes);
  while (server.clients() == before && !deadline.passed()) sleep_for(Duration::from_ms(1));
  return raw;
}

/// Clients that come one after the other, begin a frame each and read no further.
std::vector<Raw> silent_clients(Server& server, Video& video, int count) {
  std::vector<Raw> silent;
  for (int i = 0; i < count; ++i) {
    silent.push_back(taken_by(server, 4096));
    const auto deadline = Deadline::after(Duration::from_ms(20'000));
    server.publish(video.next());
    while (!silent.back().hears(Duration::from_ms(200)) && !deadline.passed()) server.publish(video.next());
    for (int n = 0; n < 5; ++n) server.publish(video.next());
  }
  return silent;
}

constexpr std::size_t kMostHeld = 96U << 20U;

/// The bound holds when what was published has been distributed, of which the newest is a part.
void expect_bounded(const Video& video) {
  const auto deadline = Deadline::after(Duration::from_ms(20'000));
  while (video.bytes_held() > kMostHeld && !deadline.passed()) sleep_for(Duration::from_ms(2));
  EXPECT_LE(video.bytes_held(), kMostHeld);
}

TEST(WireHostile, SilentClientsHoldNoMoreThanTheBoundOverAll) {
  const auto server = *Server::listen("127.0.0.1", 0);
  Video video(1920, 1080);
  const DeviceTime began = device_now();
  const std::vector<Raw> silent = silent_clients(*server, video, 16);
  expect_bounded(video);
  const auto counters = server->take_counters();
  // A frame that has begun each, and few others; on a machine that takes longer, silence itself has sent some away.
  if (device_now() - began < Duration::from_ms(9000)) {
    EXPECT_GE(counters.clients, 13U);
  }
  EXPECT_GT(counters.messages_shed, 0U);
}

TEST(WireHostile, TheLongestSilentGoesWhereBegunFramesAloneAreTooMany) {
  const auto server = *Server::listen("127.0.0.1", 0);
  Video video(3840, 2160);
  const std::vector<Raw> silent = silent_clients(*server, video, 6);
  expect_bounded(video);
  const auto counters = server->take_counters();
  EXPECT_GE(counters.clients_shed, 1U);
  EXPECT_GE(counters.clients, 2U);  // all of them would go after ten seconds
  // Who reads is served all the same.
  const auto good = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  const auto deadline = Deadline::after(Duration::from_ms(30'000));
  int frames = 0;
  while (frames < 3 && !deadline.passed()) {
    server->publish(video.next());
    const auto event = good->next(Deadline::after(Duration::from_ms(500)));
    ASSERT_TRUE(event) << event.error().what;
    if (*event && std::holds_alternative<VideoFrame>(**event)) ++frames;
  }
  EXPECT_EQ(frames, 3);
  expect_bounded(video);
}

TEST(WireHostile, WhoFindsNoRoomIsRefusedAndCounted) {
  const auto server = *Server::listen("127.0.0.1", 0);
  std::vector<Raw> clients;
  clients.reserve(17);
  for (int i = 0; i < 16; ++i) clients.push_back(taken_by(*server));
  clients.push_back(Raw::connected_to(server->port()));
  EXPECT_TRUE(clients.back().ends(Duration::from_ms(20'000)));
  EXPECT_EQ(server->take_counters().clients, 16U);
  EXPECT_EQ(server->take_counters().clients_shed, 1U);
}

}  // namespace
}  // namespace birdseye::wire
