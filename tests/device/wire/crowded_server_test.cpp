// What a server does where too many want to be served, and where one asks without end.
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

}  // namespace
}  // namespace birdseye::wire
