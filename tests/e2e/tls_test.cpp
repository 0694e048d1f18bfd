// The appliance beyond this machine: by TLS to machines that it knows, and plain only where that is allowed and said.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <stdlib.h>

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "device/wire/server.hpp"
#include "drivers/identity/known_keys.hpp"
#include "drivers/identity/machine_key.hpp"
#include "host/link/appliance_link.hpp"
#include "tests/support/child.hpp"
#include "tests/support/command.hpp"
#include "tests/support/programs_folder.hpp"
#include "tests/support/scratch.hpp"

namespace birdseye {
namespace {

using testing::Scratch;

/// One by which this machine speaks to others; empty: it has none.
std::string own_address() {
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return {};
  const std::unique_ptr<ifaddrs, void (*)(ifaddrs*)> owner(all, ::freeifaddrs);
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text.data(), text.size());
    if (!wire::is_loopback(text.data())) return text.data();
  }
  return {};
}

/// An appliance without instruments, which says so, on all addresses of this machine, and a host with another key.
class Beyond : public ::testing::Test {
 protected:
  void SetUp() override {
    address_ = own_address();
    if (address_.empty()) GTEST_SKIP() << "this machine has no address but its own";
    ::setenv("BIRDSEYE_IDENTITY", host_folder_.c_str(), 1);
    port_ = (*wire::Server::listen("127.0.0.1", 0))->port();
  }
  [[nodiscard]] std::string config(const std::string& more) const {
    return scratch_.file("c.toml",
                         "[tracker]\ndevice = \"/nonexistent\"\n[camera]\nsource = \"socket:/nonexistent\"\n"
                         "[wire]\nbind = \"0.0.0.0\"\nport = " +
                             std::to_string(port_) + "\n" + more);
  }
  void start(const std::string& more = "") {
    appliance_.emplace(std::vector<std::string>{"env", "BIRDSEYE_IDENTITY=" + cart_folder_,
                                                testing::programs_folder() + "/birdseyed", "--config", config(more)});
  }
  [[nodiscard]] std::string server() const { return address_ + ":" + std::to_string(port_); }
  /// STATUS, or why there is none.
  static std::string status_of(const std::string& server) {
    const auto client = host::connect_appliance(server);
    if (!client) return client.error().what;
    for (;;) {
      const auto event = (*client)->next(Deadline::after(Duration::from_ms(20'000)));
      if (!event) return event.error().what;
      if (!*event) return "nothing";
      if (const auto* status = std::get_if<wire::Status>(&**event)) return status->text;
    }
  }
  static void know(const std::string& folder, const std::string& other, const std::string& name) {
    const auto key = MachineKey::open(other);
    ASSERT_TRUE(key) << key.error().what;
    auto known = KnownKeys::read(folder, {});
    ASSERT_TRUE(known && known->add(name, key->public_key()));
  }

  Scratch scratch_;
  std::string cart_folder_ = scratch_ / "cart", host_folder_ = scratch_ / "host", address_;
  int port_ = 0;
  std::optional<testing::Child> appliance_;
};

TEST_F(Beyond, TheApplianceSpeaksTlsToMachinesThatItKnowsAndToNoOther) {
  start();
  EXPECT_NE(status_of(server()).find("its key is not known here; pair the two machines: birdseye pair"),
            std::string::npos);
  know(host_folder_, cart_folder_, "cart");
  EXPECT_NE(status_of(server()).find("does not know this machine's key; pair the two machines"), std::string::npos);
  know(cart_folder_, host_folder_, "host");
  EXPECT_NE(status_of(server()).find("tracker"), std::string::npos) << "known without a restart";
  EXPECT_NE(status_of("plain:" + server()).find("the appliance has gone"), std::string::npos);
  EXPECT_NE(status_of("127.0.0.1:" + std::to_string(port_)).find("tracker"), std::string::npos);
}

TEST_F(Beyond, AnotherKnownMachineThanTheOneThatIsNamedIsRefusedByName) {
  start();
  know(host_folder_, cart_folder_, "cart-2");
  know(cart_folder_, host_folder_, "host");
  EXPECT_NE(status_of("cart-2@" + server()).find("tracker"), std::string::npos);
  const std::string other = status_of("cart-1@" + server());
  EXPECT_NE(other.find("cart-2 answers there, and not cart-1"), std::string::npos) << other;
  const std::string here = status_of("cart-2@127.0.0.1:" + std::to_string(port_));
  EXPECT_NE(here.find("nothing shows whether it is cart-2"), std::string::npos) << here;
}

TEST_F(Beyond, WhereNobodyIsNamedItIsToldWhoAnswers) {
  start();
  know(host_folder_, cart_folder_, "cart-2");
  know(cart_folder_, host_folder_, "host");
  EXPECT_EQ((*host::connect_appliance(server()))->machine(), "cart-2");
  EXPECT_EQ((*host::connect_appliance("127.0.0.1:" + std::to_string(port_)))->machine(), "");
}

TEST_F(Beyond, PlainIsSaidWhereItIsAllowed) {
  start("allow_plain = true\n");
  EXPECT_NE(status_of("plain:" + server()).find("the wire is plain"), std::string::npos);
  EXPECT_TRUE((*host::connect_appliance("plain:" + server()))->is_plain());
  EXPECT_FALSE((*host::connect_appliance("127.0.0.1:" + std::to_string(port_)))->is_plain());
}

TEST_F(Beyond, ACheckSaysWhoMayConnect) {
  const auto by_tls = testing::run("birdseyed", "--check --config " + config(""));
  EXPECT_NE(by_tls.output.find("paired machines by TLS"), std::string::npos) << by_tls.output;
  const auto plain = testing::run("birdseyed", "--check --config " + config("allow_plain = true\n"));
  EXPECT_NE(plain.output.find("the wire is plain"), std::string::npos) << plain.output;
}

std::string line_of(const std::string& output, const std::string& beginning) {
  const std::size_t begin = output.find(beginning);
  return begin == std::string::npos ? "" : output.substr(begin, output.find('\n', begin) - begin);
}

TEST_F(Beyond, PeopleWhoCompareTheCodeIntroduceTwoMachinesToARunningAppliance) {
  start();
  testing::Child cart({"sh", "-c",
                       "echo y | BIRDSEYE_IDENTITY=" + cart_folder_ + " " + testing::programs_folder() +
                           "/birdseyed pair --name host-1 --port 0 --config " + config("")});
  const std::string asks = "for two minutes: birdseye pair THIS_MACHINE:";
  ASSERT_TRUE(cart.says({asks}, Deadline::after(Duration::from_ms(20'000)))) << cart.output();
  const std::string port = line_of(cart.output(), asks).substr(asks.size());
  const auto host = testing::run("birdseye", "pair " + address_ + ":" + port + " --name cart-1",
                                 "echo y | env BIRDSEYE_IDENTITY=" + host_folder_);
  EXPECT_EQ(host.code, 0) << host.output;
  EXPECT_NE(host.output.find("paired with cart-1, in "), std::string::npos) << host.output;
  EXPECT_TRUE(cart.says({"paired with host-1, in "}, Deadline::after(Duration::from_ms(20'000)))) << cart.output();
  EXPECT_EQ(line_of(cart.output(), "code: "), line_of(host.output, "code: "));
  EXPECT_EQ(line_of(host.output, "code: ").size(), 13U);
  EXPECT_NE(status_of(server()).find("tracker"), std::string::npos);
}

}  // namespace
}  // namespace birdseye
