#include "tests/vm/cart.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "drivers/system/wait.hpp"
#include "tests/support/programs_folder.hpp"

namespace birdseye::vm {

Cart::Cart(Machine& machine, const std::string& name, const std::string& config) : machine_(machine), name_(name) {
  // Not on the guest's view of the tree, which need not show what changes out here.
  std::ofstream(machine.out() / (name + ".toml"))
      << config << fmt::format("[wire]\nbind = \"0.0.0.0\"\nallow_plain = true\nport = {}\n", Machine::kGuestPort);
  machine.must(fmt::format("start {0} env BIRDSEYE_IDENTITY=/run/identity {1}/birdseyed --config /run/out/{0}.toml",
                           name, testing::programs_folder()));
  (void)some<wire::Birds>("first poses", 1);
  (void)some<wire::VideoFrame>("first frame", 1);
}

Cart::~Cart() {
  client_.reset();
  machine_.must("stop " + name_);
}

std::optional<wire::Event> Cart::any(Deadline deadline) {
  // The port is open out here long before anybody listens in there, so a connection that ends at once says nothing.
  while (!deadline.passed()) {
    if (!client_) {
      if (auto client = wire::Client::connect("127.0.0.1", machine_.port(), deadline)) client_ = *std::move(client);
    }
    if (!client_) return std::nullopt;
    auto event = client_->next(deadline);
    if (event) return *std::move(event);
    client_.reset();
    parted_ = event.error().what;
    sleep_for(Duration::from_ms(100));
  }
  return std::nullopt;
}

void Cart::complain(const std::string& what) {
  const Answer log = machine_.run("tail -5 /run/out/" + name_ + ".log");
  ADD_FAILURE() << "no " << what << "; " << name_ << " says:\n" << log.output << "\nthe last connection: " << parted_;
  gone_ = log.code != 0 || machine_.run("[ -e /run/started/" + name_ + ".code ]").code == 0;
}

void Cart::lock_camera(bool on) {
  ASSERT_TRUE(client_);
  const auto asked = client_->lock_camera(on, Deadline::after(Duration::from_ms(5000)));
  EXPECT_TRUE(asked) << asked.error().what;
}

}  // namespace birdseye::vm
