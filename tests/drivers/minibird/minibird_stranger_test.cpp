#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "drivers/minibird/minibird.hpp"
#include "tests/drivers/minibird/scripted_unit.hpp"

namespace birdseye::drivers::minibird {
namespace {

using birdseye::testing::without_waits;
using ::testing::HasSubstr;

/// What is no miniBIRD.
class Stranger final : public ByteStream {
 public:
  /// replies: to each byte; chatter: what comes by itself, at each read.
  Stranger(std::function<Bytes(std::uint8_t)> replies, std::function<Bytes()> chatter)
      : replies_(std::move(replies)), chatter_(std::move(chatter)) {}
  Result<std::size_t> read(std::span<std::uint8_t> into, Deadline deadline) override {
    for (const std::uint8_t byte : chatter_()) pending_.push_back(byte);
    if (pending_.empty()) sleep_until(deadline);
    const std::size_t n = std::min(into.size(), pending_.size());
    std::copy_n(pending_.begin(), n, into.begin());
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(n));
    return n;
  }
  Result<void> write(std::span<const std::uint8_t> bytes, Deadline /*deadline*/) override {
    for (const std::uint8_t byte : bytes) {
      for (const std::uint8_t reply : replies_(byte)) pending_.push_back(reply);
    }
    return {};
  }
  void discard_input() override { pending_.clear(); }
  bool set_rts(bool /*asserted*/) override { return true; }
  [[nodiscard]] const std::string& name() const override { return name_; }

 private:
  std::function<Bytes(std::uint8_t)> replies_;
  std::function<Bytes()> chatter_;
  std::deque<std::uint8_t> pending_;
  std::string name_ = "/dev/test";
};

Error refusal(std::function<Bytes(std::uint8_t)> replies, std::function<Bytes()> chatter) {
  const auto bird =
      MiniBird::start(std::make_unique<Stranger>(std::move(replies), std::move(chatter)), without_waits());
  EXPECT_FALSE(bird);
  return bird ? Error{} : bird.error();
}

Bytes nothing() {
  return {};
}

TEST(MiniBirdStart, AnEchoIsNamed) {
  const Error error = refusal([](std::uint8_t byte) { return Bytes{byte}; }, nothing);
  EXPECT_EQ(error.code, Errc::bad_format);
  EXPECT_THAT(error.what, HasSubstr("sends back"));
}

TEST(MiniBirdStart, AReceiverOfSatellitesIsNamedByWhatItSays) {
  const std::string line = "$GPGGA,123519,4807.038,N\r\n";
  const Error error = refusal([](std::uint8_t) { return Bytes{}; }, [&] { return Bytes(line.begin(), line.end()); });
  EXPECT_EQ(error.code, Errc::bad_format);
  EXPECT_THAT(error.what, HasSubstr("no miniBIRD"));
  EXPECT_THAT(error.what, HasSubstr("GPGGA"));
  // The same, once in a while: nothing for some reads, then a line.
  int reads = 0;
  const Error rare = refusal([](std::uint8_t) { return Bytes{}; },
                             [&] { return ++reads % 7 == 0 ? Bytes(line.begin(), line.end()) : Bytes{}; });
  EXPECT_TRUE(rare.code == Errc::bad_format || rare.code == Errc::timeout) << rare.what;
}

TEST(MiniBirdStart, GarbageIsRefused) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const auto bytes = [&random](std::size_t most) {
      Bytes out(random() % (most + 1));
      for (std::uint8_t& byte : out) byte = static_cast<std::uint8_t>(random());
      return out;
    };
    const Error error = seed % 2 == 0 ? refusal([&](std::uint8_t) { return bytes(12); }, nothing)
                                      : refusal([](std::uint8_t) { return Bytes{}; }, [&] { return bytes(3); });
    EXPECT_TRUE(error.code == Errc::bad_format || error.code == Errc::timeout) << error.what;
  }
}

}  // namespace
}  // namespace birdseye::drivers::minibird
