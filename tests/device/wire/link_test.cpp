// Server and client over links of this process, without a socket: what they rest on is the interface alone.

#include "device/wire/link.hpp"

#include <gtest/gtest.h>

#include <array>
#include <string>
#include <vector>

#include "device/wire/client.hpp"
#include "device/wire/server.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/local/local_link.hpp"

namespace birdseye::wire {
namespace {

constexpr Duration kShort = Duration::from_ms(5), kLong = Duration::from_ms(60'000);

void wait_for_clients(const Server& server, std::size_t count) {
  for (const Deadline end = Deadline::after(kLong); server.clients() != count && !end.passed();)
    sleep_for(Duration::from_ms(1));
  ASSERT_EQ(server.clients(), count);
}

Packet status(const std::string& text) {
  return pack(Status{.ok = true, .text = text}, DeviceTime{1});
}

TEST(Link, TheWireRunsWithinOneProcess) {
  const hw_sim::LocalNetwork network({.holds = 1000});  // so that packets go in parts
  const auto server = Server::over(network.listener());
  auto client = Client::over(network.connect(), "here");
  wait_for_clients(*server, 1);
  const std::string text(900, 'x');  // with its head more than a link holds
  server->publish(status(text));
  const auto event = client->next(Deadline::after(kLong));
  ASSERT_TRUE(event && *event);
  EXPECT_EQ(std::get<Status>(**event).text, text);
  EXPECT_FALSE(*client->next(Deadline::after(kShort)));
  client.reset();
  wait_for_clients(*server, 0);
}

TEST(Link, AServerThatGoesIsDisconnected) {
  const hw_sim::LocalNetwork network({.holds = 1000});  // so that packets go in parts
  auto server = Server::over(network.listener());
  const auto client = Client::over(network.connect(), "here");
  wait_for_clients(*server, 1);
  server.reset();
  EXPECT_EQ(client->next(Deadline::after(kLong)).error().code, Errc::disconnected);
}

TEST(Link, ACutConnectionIsDisconnectedAtBothEndsAndAnotherCanBeMade) {
  const hw_sim::LocalNetwork network({});
  const auto server = Server::over(network.listener());
  const auto client = Client::over(network.connect(), "here");
  wait_for_clients(*server, 1);
  network.cut();
  EXPECT_EQ(client->next(Deadline::after(kLong)).error().code, Errc::disconnected);
  wait_for_clients(*server, 0);
  const auto again = Client::over(network.connect(), "here");
  wait_for_clients(*server, 1);
  server->publish(status("back"));
  const auto event = again->next(Deadline::after(kLong));
  ASSERT_TRUE(event && *event);
  EXPECT_EQ(std::get<Status>(**event).text, "back");
}

TEST(Link, OfTcpCarriesWhatItHasTakenAndSaysWhenTheOtherSideHasGone) {
  const auto listener = *listen_tcp("127.0.0.1", 0);
  std::span<LinkWatch> nobody;
  EXPECT_FALSE(listener->wait(nobody, true, Deadline::after(kShort)));
  auto here = *connect_tcp("127.0.0.1", listener->port(), Deadline::after(kLong));
  EXPECT_FALSE(listener->wait(nobody, false, Deadline::after(kShort))) << "nobody is to be accepted yet";
  ASSERT_TRUE(listener->wait(nobody, true, Deadline::after(kLong)));
  auto there = listener->accept();
  ASSERT_TRUE(there);

  std::vector<std::uint8_t> got(100);
  EXPECT_EQ(*here->read_some(got), 0U);
  EXPECT_FALSE(here->wait_readable(Deadline::after(kShort)));
  const std::vector<std::uint8_t> head{1, 2, 3}, rest{4, 5};
  const std::array<std::span<const std::uint8_t>, 2> parts{head, rest};
  EXPECT_EQ(*there->write_some(parts), 5U);
  ASSERT_TRUE(here->wait_readable(Deadline::after(kLong)));
  got.resize(*here->read_some(got));
  EXPECT_EQ(got, (std::vector<std::uint8_t>{1, 2, 3, 4, 5}));

  LinkWatch watch{.link = there.get(), .to_write = true};
  listener->wake();
  listener->wait(std::span(&watch, 1), true, Deadline::after(kLong));
  EXPECT_FALSE(watch.readable || watch.broken);
  here.reset();
  ASSERT_TRUE(there->wait_readable(Deadline::after(kLong)));
  EXPECT_EQ(there->read_some(got).error().code, Errc::disconnected);
}

}  // namespace
}  // namespace birdseye::wire
