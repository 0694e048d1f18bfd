// Two machines are introduced: alike codes only where nobody stands between, and nothing is written unless both say
// yes.

#include "device/wire/pairing.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>

#include <array>
#include <fstream>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "device/wire/tcp_link.hpp"
#include "drivers/identity/known_keys.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/synced_files.hpp"
#include "tests/support/tls_machine.hpp"

namespace birdseye::wire {
namespace {

using Side = TlsLink::Side;
using testing::Scratch;

Deadline soon() {
  return Deadline::after(Duration::from_ms(30'000));
}

/// A machine, its person and what the person saw.
struct Machine {
  Scratch scratch;
  std::filesystem::path folder = scratch / "identity";
  bool says = true;
  std::string code;

  [[nodiscard]] PairingPlan plan(const std::string& name) {
    return {folder, name, [this](const Introduction& introduction, Deadline) {
              code = introduction.code;
              return says;
            }};
  }
  [[nodiscard]] PublicKey key() const { return MachineKey::open(folder)->public_key(); }
  [[nodiscard]] std::optional<std::string> name_of(const Machine& other) const {
    return KnownKeys::read(folder, {})->name_of(other.key());
  }
};

struct Meeting {
  Result<Paired> cart, host;
};

Meeting meet(Machine& cart, Machine& host) {
  std::promise<int> port;
  auto cart_paired = std::async(std::launch::async, [&] {
    return pair_as_server(cart.plan("host"), "127.0.0.1", 0, soon(), [&](int listening) { port.set_value(listening); });
  });
  auto host_paired = pair_as_client(host.plan("cart"), "127.0.0.1", port.get_future().get(), soon());
  return {cart_paired.get(), std::move(host_paired)};
}

TEST(Pairing, BothSeeTheSameCodeAndKnowEachOtherAfterwards) {
  Machine cart, host;
  testing::forget_synced();
  const auto [cart_paired, host_paired] = meet(cart, host);
  ASSERT_TRUE(cart_paired) << cart_paired.error().what;
  ASSERT_TRUE(host_paired) << host_paired.error().what;
  EXPECT_EQ(cart.code, host.code);
  EXPECT_EQ(cart.code.size(), 7U) << cart.code;
  EXPECT_EQ(cart.name_of(host), "host");
  EXPECT_EQ(host.name_of(cart), "cart");
  EXPECT_TRUE(testing::is_synced(cart.folder / "known"));
  EXPECT_EQ(testing::contents_of(host.folder / "cart.crt"), testing::contents_of(cart.folder / "own.crt"));
  EXPECT_EQ(testing::contents_of(cart.folder / "host.crt"), testing::contents_of(host.folder / "own.crt"));
}

TEST(Pairing, AMachineThatCallsItselfOwnDoesNotTakeThePlaceOfTheOwnCertificate) {
  Machine cart, host;
  (void)meet(cart, host);
  const std::string before = testing::contents_of(cart.folder / "own.crt");
  std::filesystem::remove(cart.folder / "known");
  std::promise<int> port;
  auto cart_paired = std::async(std::launch::async, [&] {
    return pair_as_server(cart.plan("own"), "127.0.0.1", 0, soon(), [&](int listening) { port.set_value(listening); });
  });
  (void)pair_as_client(host.plan("cart"), "127.0.0.1", port.get_future().get(), soon());
  EXPECT_FALSE(cart_paired.get());
  EXPECT_EQ(testing::contents_of(cart.folder / "own.crt"), before);
  EXPECT_FALSE(cart.name_of(host));
}

TEST(Pairing, AMachineThatHasTheNameOfAnotherIsKnownByAnotherName) {
  Machine cart, first, second;
  std::vector<std::string> names;
  for (Machine* const host : {&first, &second}) {
    std::promise<int> port;
    auto cart_paired = std::async(std::launch::async, [&] {
      return pair_as_server(cart.plan(""), "127.0.0.1", 0, soon(), [&](int listening) { port.set_value(listening); });
    });
    EXPECT_TRUE(pair_as_client(host->plan("cart"), "127.0.0.1", port.get_future().get(), soon()));
    const auto paired = cart_paired.get();
    ASSERT_TRUE(paired) << paired.error().what;
    names.push_back(paired->name);
  }
  // All three are this machine, and so is called whoever has no other name.
  EXPECT_EQ(names, (std::vector<std::string>{machine_name() + "-2", machine_name() + "-3"}));
  EXPECT_EQ(cart.name_of(second), names.back());
  EXPECT_TRUE(std::filesystem::exists(cart.folder / (names.back() + ".crt")));
}

TEST(Pairing, ANameThatAnotherMachineHasPairsNeither) {
  Machine cart, first, second;
  (void)meet(cart, first);
  const auto [cart_paired, second_paired] = meet(cart, second);
  ASSERT_FALSE(cart_paired);
  EXPECT_NE(cart_paired.error().what.find("give another name, as host-2"), std::string::npos);
  EXPECT_FALSE(second_paired);
  EXPECT_FALSE(second.name_of(cart));
  EXPECT_FALSE(cart.name_of(second));
}

TEST(Pairing, AKeyIsKnownOnlyOnceAllElseIsOnTheDisk) {
  Machine cart, host;
  std::filesystem::create_directories(cart.folder / "host.crt" / "in the way");
  std::filesystem::permissions(cart.folder, std::filesystem::perms::owner_all);
  EXPECT_FALSE(meet(cart, host).cart);
  EXPECT_FALSE(cart.name_of(host));
  std::filesystem::remove_all(cart.folder / "host.crt");
  testing::forget_synced();
  EXPECT_TRUE(meet(cart, host).cart);
  EXPECT_EQ(cart.name_of(host), "host");
  EXPECT_TRUE(testing::is_synced(cart.folder / "host.crt"));
}

TEST(Pairing, AFileBesideACertificateIsLeftAlone) {
  Machine cart, host;
  std::filesystem::create_directories(cart.folder);
  std::filesystem::permissions(cart.folder, std::filesystem::perms::owner_all);
  const std::filesystem::path beside = cart.folder / "host.crt.part";
  std::ofstream(beside) << "another's";
  const Meeting meeting = meet(cart, host);
  ASSERT_TRUE(meeting.cart) << meeting.cart.error().what;
  EXPECT_EQ(testing::contents_of(beside), "another's");
  EXPECT_NE(testing::contents_of(cart.folder / "host.crt").find("BEGIN CERTIFICATE"), std::string::npos);
}

TEST(Pairing, EachPairingHasACodeOfItsOwn) {
  Machine cart, host;
  (void)meet(cart, host);
  const std::string first = host.code;
  (void)meet(cart, host);
  EXPECT_NE(host.code, first);
  EXPECT_EQ(host.code, cart.code);
}

TEST(Pairing, WhereOneSaysNoNeitherKnowsTheOther) {
  for (const bool cart_says : {false, true}) {
    Machine cart, host;
    cart.says = cart_says;
    host.says = !cart_says;
    const auto [cart_paired, host_paired] = meet(cart, host);
    EXPECT_FALSE(cart_paired);
    EXPECT_FALSE(host_paired);
    EXPECT_FALSE(cart.name_of(host));
    EXPECT_FALSE(host.name_of(cart));
    EXPECT_FALSE(std::filesystem::exists(cart.folder / "host.crt"));
  }
}

struct Ends {
  std::unique_ptr<TlsLink> client, server;
};

/// Two machines that have made a connection, whoever they are.
Ends connect(const testing::TlsMachine& client, const testing::TlsMachine& server) {
  std::array<int, 2> fds{};
  EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, fds.data()), 0);
  Ends ends{*TlsLink::over(UniqueFd(fds[0]), *pairing_tls(client.key()), Side::client),
            *TlsLink::over(UniqueFd(fds[1]), *pairing_tls(server.key()), Side::server)};
  for (int i = 0; i < 10; ++i) {
    for (TlsLink* const end : {ends.client.get(), ends.server.get()}) {
      if (!end->is_known()) (void)end->shake();
    }
  }
  EXPECT_TRUE(ends.client->is_known() && ends.server->is_known());
  return ends;
}

/// So many bytes from one link to another.
void relay(TlsLink& from, TlsLink& to, std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::size_t have = 0;
  while (have < count && from.wait_readable(soon())) {
    const auto got = from.read_some(std::span(bytes).subspan(have));
    if (!got) return;
    have += *got;
  }
  const std::span<const std::uint8_t> part(bytes);
  EXPECT_EQ(*to.write_some(std::span(&part, 1)), count);
}

TEST(Pairing, WhoStandsBetweenGivesTwoCodes) {
  const testing::TlsMachine host, cart, between;
  const Ends near = connect(host, between), far = connect(between, cart);
  auto at_host = std::async(std::launch::async, [&] { return introduce(*near.client, Side::client, "host", soon()); });
  auto at_cart = std::async(std::launch::async, [&] { return introduce(*far.server, Side::server, "cart", soon()); });
  // What each says reaches the other as it was said.
  relay(*near.server, *far.client, 32);
  relay(*far.client, *near.server, 96);
  relay(*near.server, *far.client, 96);
  const auto host_sees = at_host.get(), cart_sees = at_cart.get();
  ASSERT_TRUE(host_sees && cart_sees);
  EXPECT_EQ(host_sees->name, "cart");
  EXPECT_EQ(cart_sees->name, "host");
  EXPECT_NE(host_sees->code, cart_sees->code);
  EXPECT_EQ(host_sees->key, between.key().public_key());
}

TEST(Pairing, AClientThatChoosesItsNumberAfterItHasSeenTheServersIsFoundOut) {
  const testing::TlsMachine host, cart;
  const Ends ends = connect(host, cart);
  bool begun = false;
  auto at_cart =
      std::async(std::launch::async, [&] { return introduce(*ends.server, Side::server, "cart", soon(), &begun); });
  const std::vector<std::uint8_t> promise(32, 1), card(96, 2);
  for (const auto& bytes : {promise, card}) {
    const std::span<const std::uint8_t> part(bytes);
    EXPECT_TRUE(ends.client->write_some(std::span(&part, 1)));
  }
  const auto seen = at_cart.get();
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().code, Errc::bad_value);
  EXPECT_TRUE(begun);
}

TEST(Pairing, ANameIsShownWithoutWhatMovesACursor) {
  const testing::TlsMachine host, cart;
  const Ends ends = connect(host, cart);
  auto at_cart = std::async(std::launch::async, [&] { return introduce(*ends.server, Side::server, "cart", soon()); });
  const auto at_host = introduce(*ends.client, Side::client, "host\x1b[2J one", soon());
  const auto seen = at_cart.get();
  ASSERT_TRUE(seen && at_host);
  EXPECT_EQ(seen->name, "host??2J?one");
}

TEST(Pairing, WhoConnectsAndGoesIsNotTheOneTry) {
  Machine cart, host;
  const testing::TlsMachine scanner;
  std::promise<int> listening;
  auto cart_paired = std::async(std::launch::async, [&] {
    return pair_as_server(cart.plan("host"), "127.0.0.1", 0, soon(), [&](int port) { listening.set_value(port); });
  });
  const int port = listening.get_future().get();
  {
    auto link = *TlsLink::over(*connect_socket("127.0.0.1", port, soon()), *pairing_tls(scanner.key()), Side::client);
    for (auto shaken = link->shake(); shaken && !*shaken; shaken = link->shake()) link->wait_shaken(soon());
  }
  EXPECT_TRUE(pair_as_client(host.plan("cart"), "127.0.0.1", port, soon()));
  EXPECT_TRUE(cart_paired.get());
}

TEST(Pairing, ThoseWhoComeAndSayNothingKeepNobodyWaiting) {
  Machine cart, host;
  const testing::TlsMachine silent;
  std::promise<int> listening;
  auto cart_paired = std::async(std::launch::async, [&] {
    return pair_as_server(cart.plan("host"), "127.0.0.1", 0, soon(), [&](int port) { listening.set_value(port); });
  });
  const int port = listening.get_future().get();
  std::vector<std::unique_ptr<TlsLink>> links;
  // Were each waited for by itself, a client would have given up before its turn comes.
  for (int i = 0; i < 4; ++i) {
    links.push_back(
        *TlsLink::over(*connect_socket("127.0.0.1", port, soon()), *pairing_tls(silent.key()), Side::client));
    TlsLink& link = *links.back();
    for (auto shaken = link.shake(); shaken && !*shaken; shaken = link.shake()) link.wait_shaken(soon());
  }
  EXPECT_TRUE(pair_as_client(host.plan("cart"), "127.0.0.1", port, soon()));
  EXPECT_TRUE(cart_paired.get());
}

TEST(Pairing, WhoCameAndDidNotBeginIsNamedByItsAddress) {
  Machine cart;
  const testing::TlsMachine silent;
  std::promise<int> listening;
  auto cart_paired = std::async(std::launch::async, [&] {
    return pair_as_server(cart.plan("host"), "127.0.0.1", 0, Deadline::after(Duration::from_ms(3000)),
                          [&](int port) { listening.set_value(port); });
  });
  const auto link = *TlsLink::over(*connect_socket("127.0.0.1", listening.get_future().get(), soon()),
                                   *pairing_tls(silent.key()), Side::client);
  for (auto shaken = link->shake(); shaken && !*shaken; shaken = link->shake()) link->wait_shaken(soon());
  const auto paired = cart_paired.get();
  ASSERT_FALSE(paired);
  EXPECT_EQ(paired.error().what, "nobody came to be paired; 127.0.0.1 came and did not begin");
}

TEST(Pairing, ATryThatFailedEndsTheWindow) {
  Machine cart;
  const testing::TlsMachine other;
  std::promise<int> listening;
  auto cart_paired = std::async(std::launch::async, [&] {
    return pair_as_server(cart.plan("host"), "127.0.0.1", 0, soon(), [&](int port) { listening.set_value(port); });
  });
  {
    auto link = *TlsLink::over(*connect_socket("127.0.0.1", listening.get_future().get(), soon()),
                               *pairing_tls(other.key()), Side::client);
    for (auto shaken = link->shake(); shaken && !*shaken; shaken = link->shake()) link->wait_shaken(soon());
    const std::vector<std::uint8_t> promise(32, 1);
    const std::span<const std::uint8_t> part(promise);
    EXPECT_TRUE(link->write_some(std::span(&part, 1)));
    EXPECT_TRUE(link->wait_readable(soon()));
  }
  const auto paired = cart_paired.get();
  ASSERT_FALSE(paired);
  EXPECT_EQ(paired.error().code, Errc::disconnected);
  EXPECT_EQ(cart.code, "");
}

}  // namespace
}  // namespace birdseye::wire
