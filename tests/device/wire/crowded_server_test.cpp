// What a server does where too many want to be served, and where one asks without end.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <list>
#include <span>

#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/system/unique_fd.hpp"
#include "tests/support/connection_from.hpp"

namespace birdseye::wire {
namespace {

constexpr std::size_t kPlaces = 16;

using testing::connection;
using testing::is_put_out;
using testing::is_served;
using testing::soon;

class CrowdedServer : public ::testing::Test {
 protected:
  void SetUp() override { server_->publish(pack(Status{true, "ready"}, {1})); }
  /// As many connections, each with its place.
  void fill(const char* from, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i)
      ASSERT_TRUE(is_served(clients_.emplace_back(connection(from, server_->port()))));
  }
  [[nodiscard]] UniqueFd connect(const char* from) const { return connection(from, server_->port()); }

  std::unique_ptr<Server> server_ = *Server::listen("127.0.0.1", 0);
  std::list<UniqueFd> clients_;
};

TEST_F(CrowdedServer, AMachineThatHoldsAllPlacesGivesOneUp) {
  fill("127.0.0.2", kPlaces);
  EXPECT_TRUE(is_served(connect("127.0.0.3")));
  EXPECT_TRUE(is_put_out(clients_.back())) << "the newest goes";
  EXPECT_TRUE(is_served(clients_.front()));
  EXPECT_EQ(server_->take_counters().clients_shed, 1U);
}

TEST_F(CrowdedServer, AMachineTakesNoPlaceFromOneThatHoldsAsMany) {
  fill("127.0.0.2", kPlaces / 2);
  fill("127.0.0.3", kPlaces / 2);
  EXPECT_TRUE(is_put_out(connect("127.0.0.3")));
  EXPECT_TRUE(is_served(clients_.back()));
  EXPECT_TRUE(is_served(connect("127.0.0.4")));
}

TEST_F(CrowdedServer, AMachineTakesNoPlaceFromItself) {
  fill("127.0.0.2", kPlaces);
  EXPECT_TRUE(is_put_out(connect("127.0.0.2")));
  EXPECT_EQ(server_->clients(), kPlaces);
}

TEST_F(CrowdedServer, AfterManyConnectionsThereIsStillAPlace) {
  for (int i = 0; i < 500; ++i) (void)connect("127.0.0.2");
  EXPECT_TRUE(is_served(connect("127.0.0.3")));
}

TEST_F(CrowdedServer, WhileOneAsksWithoutEndAnotherIsAnswered) {
  const auto asking = connect("127.0.0.2");
  const auto ping = pack(ClockPing{1}).bytes();
  std::vector<std::uint8_t> many;
  for (int i = 0; i < 20'000; ++i) many.insert(many.end(), ping.begin(), ping.end());
  (void)::send(asking.get(), many.data(), many.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  const auto other = Client::connect("127.0.0.1", server_->port(), soon());
  ASSERT_TRUE(other) << other.error().what;
  const auto first = (*other)->next(soon());
  EXPECT_TRUE(first && *first);
}

/// Where plain is allowed, machines that are not known: all but 127.0.0.1, which is this one.
class ServerOfStrangers : public CrowdedServer {
 protected:
  void SetUp() override {
    Admission admission;
    admission.allow_plain = true;
    admission.is_local = [](const std::string& address) { return address == "127.0.0.1"; };
    server_ = *Server::listen("127.0.0.1", 0, std::move(admission));
    CrowdedServer::SetUp();
  }
};

TEST_F(ServerOfStrangers, LeaveFourPlacesToMachinesThatAreKnown) {
  for (const char* stranger : {"127.0.0.2", "127.0.0.3", "127.0.0.4"}) fill(stranger, 4);
  EXPECT_TRUE(is_put_out(connect("127.0.0.4")));
  fill("127.0.0.1", 4);
  EXPECT_EQ(server_->clients(), kPlaces);
  EXPECT_TRUE(is_put_out(connect("127.0.0.4")));
}

TEST_F(ServerOfStrangers, GiveUpAPlaceToAMachineThatIsKnown) {
  fill("127.0.0.1", 14);
  fill("127.0.0.2", 2);
  fill("127.0.0.1", 1);
  EXPECT_TRUE(is_put_out(*std::next(clients_.begin(), 15))) << "the stranger's newest goes";
  EXPECT_TRUE(is_put_out(connect("127.0.0.3"))) << "and gets none by waiting for one who holds more";
}

TEST_F(ServerOfStrangers, ShareTheirPlacesAmongEachOther) {
  fill("127.0.0.2", 12);
  EXPECT_TRUE(is_served(connect("127.0.0.3")));
  EXPECT_TRUE(is_put_out(clients_.back()));
}

/// Whether asking for the camera's controls held them, and what the server said to it.
std::pair<bool, std::string> after_lock(Server& server, UniqueFd fd, bool known) {
  ::fcntl(fd.get(), F_SETFL, O_NONBLOCK);
  const auto client = Client::over(link_over(std::move(fd), known), "server");
  EXPECT_TRUE(client->lock_camera(true, soon()));
  while (!server.camera_locked()) {
    const auto event = client->next(Deadline::after(Duration::from_ms(20)));
    if (!event) return {false, event.error().what};
    if (!*event) continue;
    const auto* const controls = std::get_if<CameraControls>(&**event);
    if (controls != nullptr && !controls->refused.empty()) return {server.camera_locked(), controls->refused.front()};
  }
  return {true, ""};
}

TEST_F(ServerOfStrangers, MayNotHoldTheCamerasControls) {
  const auto strangers = after_lock(*server_, connect("127.0.0.2"), false);
  EXPECT_FALSE(strangers.first);
  EXPECT_EQ(strangers.second, "only this machine and paired ones may hold the camera's controls: birdseye pair");
  EXPECT_TRUE(after_lock(*server_, connect("127.0.0.1"), true).first);
}

/// A link on which the same request comes again and again.
class Flood final : public Link {
 public:
  Result<std::size_t> read_some(std::span<std::uint8_t> into) override {
    const auto ping = pack(ClockPing{1}).bytes();
    std::size_t put = 0;
    while (into.size() - put >= ping.size())
      put += static_cast<std::size_t>(std::ranges::copy(ping, into.data() + put).out - (into.data() + put));
    return put;
  }
  Result<std::size_t> write_some(std::span<const std::span<const std::uint8_t>> parts) override {
    return parts.empty() ? 0 : parts.front().size();
  }
  bool wait_readable(Deadline /*deadline*/) override { return true; }
  bool wait_writable(Deadline /*deadline*/) override { return true; }
  [[nodiscard]] std::string host() const override { return {}; }
};

TEST(ClientLink, IsReadNoFurtherOnceItHasAskedTooMuch) {
  ClientLink client(std::make_unique<Flood>());
  std::size_t asked = 0;
  // Were it read without a bound, this would not end; the rate itself would let a machine that stands still for 100 s
  // pass.
  while (client.may_ask() && asked < 10'000) asked += client.receive()->size();
  EXPECT_GE(asked, 200U);
  EXPECT_LT(asked, 10'000U);
}

TEST(ClientLink, AllOfOneMachineAreReadNoFurtherOnceTheyTogetherHaveAskedTooMuch) {
  const auto limit = std::make_shared<RateLimit>(Duration::from_ms(10'000), 300);
  std::size_t asked = 0;
  for (int i = 0; i < 16; ++i) {
    ClientLink client(std::make_unique<Flood>(), limit);
    while (client.may_ask() && asked < 10'000) asked += client.receive()->size();
  }
  EXPECT_GE(asked, 300U);
  EXPECT_LT(asked, 1000U);  // 16 by themselves: 3200
}

TEST(HostLimits, AreOfAMachineAndNotOfAConnection) {
  HostLimits limits(Duration::from_ms(1000), 10);
  const DeviceTime now{1'000'000'000};
  const auto one = limits.of("one", now);
  EXPECT_EQ(limits.of("one", now), one);
  EXPECT_NE(limits.of("other", now), one);
}

TEST(HostLimits, AreKeptUntilTheMachineHasRested) {
  HostLimits limits(Duration::from_ms(1000), 10);
  const DeviceTime now{1'000'000'000};
  limits.of("one", now)->passed(now, 12);
  EXPECT_GT(limits.of("one", now)->free_at(), now) << "it connects anew";
  EXPECT_LE(limits.of("one", now + Duration::from_ms(12'000))->free_at(), now);
}

}  // namespace
}  // namespace birdseye::wire
