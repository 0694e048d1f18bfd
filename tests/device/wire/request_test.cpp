#include <gtest/gtest.h>
#include <igtlStatusMessage.h>
#include <igtlStringMessage.h>
#include <igtlTrackingDataMessage.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>

#include "device/wire/client.hpp"
#include "device/wire/igtl_bytes.hpp"
#include "device/wire/request.hpp"
#include "device/wire/server.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::wire {
namespace {

template <typename M>
std::vector<std::uint8_t> packed(M& message) {
  message.Pack();
  const auto* bytes = static_cast<const std::uint8_t*>(message.GetPackPointer());
  return {bytes, bytes + message.GetPackSize()};
}

/// As the library of the protocol packs it, not as we do.
std::vector<std::uint8_t> start_tracking(int interval_ms) {
  const auto message = igtl::StartTrackingDataMessage::New();
  message->SetDeviceName("");
  message->SetResolution(interval_ms);
  message->SetCoordinateName("Patient");
  return packed(*message);
}

TEST(RequestReader, UnderstandsWhatTheLibrarySends) {
  RequestReader reader;
  const auto requests = reader.push(start_tracking(50));
  ASSERT_TRUE(requests && requests->size() == 1);
  const auto& tracking = std::get<TrackingRequest>(requests->front());
  EXPECT_TRUE(tracking.start);
  EXPECT_EQ(tracking.interval, Duration::from_ms(50));
  const auto status = igtl::GetStatusMessage::New();
  status->SetDeviceName("");
  EXPECT_TRUE(std::holds_alternative<StatusRequest>(reader.push(packed(*status))->front()));
}

TEST(RequestReader, ComesToTheSameHoweverItIsCut) {
  std::vector<std::uint8_t> all = start_tracking(20);
  const auto ping = pack(ClockPing{1234567890123}).bytes();
  all.insert(all.end(), ping.begin(), ping.end());
  std::mt19937 rng(3);
  for (int trial = 0; trial < 200; ++trial) {
    RequestReader reader;
    std::vector<Request> got;
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t n = std::min<std::size_t>(all.size() - at, 1 + rng() % 40);
      const auto whole = reader.push(std::span(all).subspan(at, n));
      ASSERT_TRUE(whole);
      got.insert(got.end(), whole->begin(), whole->end());
      at += n;
    }
    ASSERT_EQ(got.size(), 2U);
    EXPECT_EQ(std::get<ClockPing>(got[1]).host_sent_ns, 1234567890123);
    EXPECT_FALSE(reader.waiting());
  }
}

TEST(RequestReader, RefusesDamageAndGarbage) {
  auto bytes = pack(ClockPing{1}).bytes();
  bytes.back() ^= 1;
  RequestReader reader;
  EXPECT_TRUE(std::holds_alternative<DamagedRequest>(reader.push(bytes)->front()));
  const std::string http = "GET / HTTP/1.1\r\nHost: an-appliance-in-an-operating-room.example\r\n\r\n";
  EXPECT_EQ(RequestReader().push({reinterpret_cast<const std::uint8_t*>(http.data()), http.size()}).error().code,
            Errc::bad_format);
  auto large = pack(ClockPing{1}).bytes();
  large[46] = 1;  // a body of 16 MiB
  EXPECT_FALSE(RequestReader().push(large));
}

/// So that a flood of such takes no time from poses.
TEST(RequestReader, ParsesNoMoreJsonThanARequestNeeds) {
  const auto asked = [](std::size_t spaces) {
    const auto message = igtl::StringMessage::New();
    message->SetDeviceName("ClockPing");
    std::string text = "{\"host_sent_ns\": 7" + std::string(spaces, ' ') + "}";
    message->SetString(text);
    return RequestReader().push(packed(*message))->front();
  };
  EXPECT_TRUE(std::holds_alternative<ClockPing>(asked(900)));
  EXPECT_TRUE(std::holds_alternative<DamagedRequest>(asked(1024)));
}

/// A socket of somebody else's, to send what we would not.
class RawClient {
 public:
  explicit RawClient(int port) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval limit{5, 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
  }
  ~RawClient() { ::close(fd_); }
  void send(const std::vector<std::uint8_t>& bytes) const {
    EXPECT_EQ(::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  /// The header of the next message; its body is passed over. Empty at the end of the connection.
  [[nodiscard]] std::optional<Header> next() const {
    std::vector<std::uint8_t> bytes(kHeaderBytes);
    if (::recv(fd_, bytes.data(), bytes.size(), MSG_WAITALL) != static_cast<ssize_t>(bytes.size())) return std::nullopt;
    const auto header = read_header(bytes, kLargestBody);
    bytes.resize(header->body_bytes);
    if (!bytes.empty()) ::recv(fd_, bytes.data(), bytes.size(), MSG_WAITALL);
    return *header;
  }

 private:
  int fd_;
};

void wait_for_clients(const Server& server, std::size_t count) {
  const auto deadline = Deadline::after(Duration::from_ms(5000));
  while (server.clients() != count && !deadline.passed()) sleep_for(Duration::from_ms(1));
  EXPECT_EQ(server.clients(), count);
}

TEST(Server, GarbageIsRefusedAndCountedAndTheOthersGoOn) {
  const auto server = *Server::listen("127.0.0.1", 0);
  const auto good = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  const RawClient hostile(server->port());
  wait_for_clients(*server, 2);
  hostile.send(std::vector<std::uint8_t>(500, 0xFF));
  EXPECT_FALSE(hostile.next());  // disconnected
  wait_for_clients(*server, 1);
  EXPECT_EQ(server->take_counters().requests_refused, 1U);
  server->publish(pack(Status{true, "still here"}, {1}));
  const auto event = good->next(Deadline::after(Duration::from_ms(5000)));
  ASSERT_TRUE(event && *event);
  EXPECT_EQ(std::get<Status>(**event).text, "still here");
}

TEST(Server, AClientThatComesIsToldHowThingsAre) {
  const auto server = *Server::listen("127.0.0.1", 0);
  server->publish(pack(Status{false, "no camera"}, {1}));
  sleep_for(Duration::from_ms(20));
  const auto client = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  EXPECT_EQ(std::get<Status>(**client->next(Deadline::after(Duration::from_ms(5000)))).text, "no camera");
}

TEST(Server, TrackingMayBeAskedForAndStopped) {
  const auto server = *Server::listen("127.0.0.1", 0);
  const RawClient client(server->port());
  wait_for_clients(*server, 1);
  const auto stop = igtl::StopTrackingDataMessage::New();
  stop->SetDeviceName("");
  client.send(packed(*stop));
  EXPECT_EQ(client.next()->type, "RTS_TDATA");
  server->publish(pack(Birds{{1}, {{"scope", {}}}}));
  server->publish(pack(Status{true, ""}, {1}));
  EXPECT_EQ(client.next()->type, "STATUS");
  client.send(start_tracking(0));
  EXPECT_EQ(client.next()->type, "RTS_TDATA");
  server->publish(pack(Birds{{1}, {{"scope", {}}}}));
  EXPECT_EQ(client.next()->type, "TDATA");
}

TEST(Server, ASubscriptionLeavesFramesAway) {
  const auto server = *Server::listen("127.0.0.1", 0);
  const auto client = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  ASSERT_TRUE(client->subscribe({.frames = false, .tracking = true}, Deadline::after(Duration::from_ms(1000))));
  VideoFrame frame;
  frame.width_px = 4;
  frame.height_px = 2;
  frame.rgb = std::make_shared<const std::vector<std::uint8_t>>(24);
  // Published until the subscription has come through; from then on only the status gets there.
  int frames = 0;
  for (int quiet = 0, i = 0; quiet < 5 && i < 500; ++i) {
    server->publish(pack(frame));
    server->publish(pack(Status{true, std::to_string(i)}, {1}));
    ++quiet;
    for (;;) {
      const auto event = client->next(Deadline::after(Duration::from_ms(5000)));
      ASSERT_TRUE(event && *event);
      if (std::holds_alternative<Status>(**event)) break;
      ++frames;
      quiet = 0;
    }
  }
  EXPECT_LT(frames, 490);
}

TEST(Client, RelatesTheAppliancesClockToItsOwn) {
  const auto server = *Server::listen("127.0.0.1", 0);
  const auto client = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  EXPECT_FALSE(client->host_from_device(device_now()));
  while (!client->host_from_device(device_now())) {
    const auto event = client->next(Deadline::after(Duration::from_ms(20)));
    ASSERT_TRUE(event) << event.error().what;
  }
  // Both ends are this machine's clock: what the exchange says must be within what it claims.
  const DeviceTime now = device_now();
  const auto related = *client->host_from_device(now);
  EXPECT_LT(std::abs(related.time.ns - now.ns), 4 * related.sigma.ns);
  // Clocks that a protocol keeps together to a few microseconds at both ends are surer than that.
  client->use_discipline({true, {20'000}, {1'000}, true, "here"}, {1'700'000'000'000'000'000});
  Health health;
  health.clock = {true, true, true, 20'000, 1'000, 1'700'000'000'000'050'000, "there"};
  server->publish(pack(health, {1}));
  for (bool told = false; !told;) {
    const auto event = client->next(Deadline::after(Duration::from_ms(5000)));
    ASSERT_TRUE(event && *event);
    told = std::holds_alternative<Health>(**event);
  }
  EXPECT_EQ(client->host_from_device({1'000'000})->time.ns, 1'050'000);
}

TEST(Client, HoldsTheCamerasControlsForAsLongAsItIsThere) {
  const auto server = *Server::listen("127.0.0.1", 0);
  const auto comes_to = [&](bool locked) {
    for (const auto deadline = Deadline::after(Duration::from_ms(10'000)); server->camera_locked() != locked;) {
      if (deadline.passed()) return false;
      sleep_for(Duration::from_ms(2));
    }
    return true;
  };
  auto one = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  auto other = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  while (server->clients() < 2) sleep_for(Duration::from_ms(2));
  EXPECT_FALSE(server->camera_locked());
  ASSERT_TRUE(one->lock_camera(true, Deadline::after(Duration::from_ms(1000))));
  ASSERT_TRUE(other->lock_camera(true, Deadline::after(Duration::from_ms(1000))));
  EXPECT_TRUE(comes_to(true));
  one.reset();
  while (server->clients() > 1) sleep_for(Duration::from_ms(2));
  EXPECT_TRUE(server->camera_locked());
  ASSERT_TRUE(other->lock_camera(false, Deadline::after(Duration::from_ms(1000))));
  EXPECT_TRUE(comes_to(false));
  ASSERT_TRUE(other->lock_camera(true, Deadline::after(Duration::from_ms(1000))));
  EXPECT_TRUE(comes_to(true));
  other.reset();
  EXPECT_TRUE(comes_to(false));

  auto listener = *Client::connect("127.0.0.1", server->port(), Deadline::after(Duration::from_ms(5000)));
  while (server->clients() == 0) sleep_for(Duration::from_ms(2));
  server->publish(pack(CameraControls{true, {"gain 3"}, {"focus: the camera has none"}}, {1}));
  const auto event = listener->next(Deadline::after(Duration::from_ms(5000)));
  ASSERT_TRUE(event && *event);
  const auto& controls = std::get<CameraControls>(**event);
  EXPECT_TRUE(controls.locked);
  EXPECT_EQ(controls.done, std::vector<std::string>{"gain 3"});
  EXPECT_EQ(controls.refused, std::vector<std::string>{"focus: the camera has none"});
}

}  // namespace
}  // namespace birdseye::wire
