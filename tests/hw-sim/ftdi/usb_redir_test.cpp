#include "hw-sim/ftdi/usb_redir.hpp"

#include <gtest/gtest.h>

namespace birdseye::hw_sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr DeviceTime kUsbStart{1'000'000'000};

void put(Bytes& bytes, std::uint64_t value, int size) {
  for (int i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>((value >> (8 * i)) & 0xFFU));
}

Bytes join(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

Bytes hello(std::uint32_t capabilities, const std::string& version) {
  Bytes bytes;
  put(bytes, 0, 4);
  put(bytes, 68, 4);
  put(bytes, 0, 4);  // the one packet whose number is short
  bytes.insert(bytes.end(), version.begin(), version.end());
  bytes.resize(12 + 64, 0);
  put(bytes, capabilities, 4);
  return bytes;
}

Bytes packet(std::uint32_t type, std::uint64_t id, const Bytes& body) {
  Bytes bytes;
  put(bytes, type, 4);
  put(bytes, body.size(), 4);
  put(bytes, id, 8);
  return join({bytes, body});
}

Bytes bulk_head(std::uint8_t endpoint, std::uint8_t status, std::size_t length) {
  Bytes bytes{endpoint, status};
  put(bytes, length & 0xFFFFU, 2);
  put(bytes, 0, 4);
  put(bytes, length >> 16U, 2);
  return bytes;
}

constexpr std::uint32_t kQemu = 0xFF;  // all that QEMU 7 can do, or more

/// A chip that QEMU knows of, at 115200 baud and a tick of a millisecond.
class Plugged : public ::testing::Test {
 protected:
  Plugged() {
    (void)usb.output();
    EXPECT_TRUE(usb.receive(hello(kQemu, "qemu"), kUsbStart));
    (void)usb.output();
    EXPECT_TRUE(chip.control({0x40, 3, 0x1A, 0, 0}, kUsbStart));
    EXPECT_TRUE(chip.control({0x40, 9, 1, 0, 0}, kUsbStart));
  }
  Bytes answer(const Bytes& bytes, DeviceTime now = kUsbStart) {
    EXPECT_TRUE(usb.receive(bytes, now));
    return usb.output();
  }
  static DeviceTime at(std::int64_t ms) { return kUsbStart + Duration::from_ms(ms); }

  Ft232r chip{Ft232rSettings{}};
  UsbRedir usb{chip};
};

TEST(UsbRedir, GreetsFirstAndDescribesTheChipOnceQemuHas) {
  Ft232r chip({});
  UsbRedir usb(chip);
  EXPECT_EQ(usb.output(), hello(0x72, "birdseye-sim ft232r"));
  EXPECT_FALSE(usb.plugged());
  ASSERT_TRUE(usb.receive(hello(kQemu, "qemu usb-redir guest 7.2.0"), kUsbStart));
  EXPECT_TRUE(usb.plugged());

  Bytes interfaces(4 + 4 * 32, 0);
  interfaces[0] = 1;
  interfaces[4 + 32] = interfaces[4 + 64] = interfaces[4 + 96] = 0xFF;
  Bytes endpoints(3 * 32 + 2 * 32, 0);
  std::fill_n(endpoints.begin(), 32, std::uint8_t{255});
  endpoints[0] = endpoints[16] = 0;
  endpoints[2] = endpoints[17] = 2;
  endpoints[96] = endpoints[96 + 32] = 8;
  endpoints[96 + 4] = endpoints[96 + 34] = 64;
  EXPECT_EQ(usb.output(), join({packet(4, 0, interfaces), packet(5, 0, endpoints),
                                packet(1, 0, {1, 0, 0, 0, 0x03, 0x04, 0x01, 0x60, 0x00, 0x06})}));
}

TEST(UsbRedir, RefusesWhatIsNoQemu) {
  const auto refused = [](const Bytes& bytes) {
    Ft232r chip({});
    return !UsbRedir(chip).receive(bytes, kUsbStart);
  };
  EXPECT_TRUE(refused(hello(0x02, "qemu of long ago")));
  EXPECT_TRUE(refused(packet(100, 1, Bytes(10))));
  EXPECT_TRUE(refused({'G', 'E', 'T', ' ', '/', ' ', 'H', 'T', 'T', 'P', '/', '1'}));
  EXPECT_FALSE(refused({0, 0, 0})) << "the rest may follow";
}

TEST_F(Plugged, SettlesConfigurationAndInterface) {
  EXPECT_EQ(answer(packet(6, 11, {1})), packet(8, 11, {0, 1}));
  EXPECT_EQ(answer(packet(7, 12, {})), packet(8, 12, {0, 1}));
  EXPECT_EQ(answer(packet(9, 13, {0, 0})), packet(11, 13, {0, 0, 0}));
  EXPECT_EQ(answer(packet(10, 14, {0})), packet(11, 14, {0, 0, 0}));
  EXPECT_EQ(answer(packet(9, 15, {0, 1})), packet(11, 15, {2, 0, 0})) << "there is but one setting";
  EXPECT_TRUE(answer(packet(3, 0, {})).empty());
  EXPECT_EQ(answer(packet(7, 16, {})), packet(8, 16, {0, 0})) << "a reset unsets it";
}

TEST_F(Plugged, PassesControlTransfersToTheChip) {
  // endpoint, request, request type, status, value, index, length
  EXPECT_EQ(answer(packet(100, 1, {0x80, 0x0A, 0xC0, 0, 0, 0, 0, 0, 1, 0})),
            packet(100, 1, {0x80, 0x0A, 0xC0, 0, 0, 0, 0, 0, 1, 0, 1}));
  EXPECT_EQ(answer(packet(100, 2, {0, 1, 0x40, 0, 0x02, 0x02, 0, 0, 0, 0})),
            packet(100, 2, {0, 1, 0x40, 0, 0x02, 0x02, 0, 0, 0, 0}));
  EXPECT_TRUE(chip.rts());
  EXPECT_EQ(answer(packet(100, 3, {0, 0x91, 0x40, 0, 0, 0, 0, 0, 0, 0})),
            packet(100, 3, {0, 0x91, 0x40, 4, 0, 0, 0, 0, 0, 0}))
      << "a stall";
}

TEST_F(Plugged, AnswersAReadAtTheTick) {
  EXPECT_TRUE(answer(packet(101, 7, bulk_head(0x81, 0, 64))).empty());
  EXPECT_EQ(usb.next_event(), at(1));
  usb.pump(at(1));
  EXPECT_EQ(usb.output(), packet(101, 7, join({bulk_head(0x81, 0, 2), {0x01, 0x60}})));
  EXPECT_FALSE(usb.next_event()) << "QEMU waits for nothing";
  usb.pump(at(5));
  EXPECT_TRUE(usb.output().empty());
}

TEST_F(Plugged, ALongReadGathersFullPacketsUpToAShortOne) {
  Bytes sent(100);
  for (std::size_t i = 0; i < sent.size(); ++i) sent[i] = static_cast<std::uint8_t>(i);
  chip.receive(sent, kUsbStart);
  EXPECT_TRUE(chip.control({0x40, 9, 20, 0, 0}, kUsbStart));
  EXPECT_TRUE(answer(packet(101, 8, bulk_head(0x81, 0, 512))).empty());
  usb.pump(at(6));
  EXPECT_TRUE(usb.output().empty()) << "one full packet so far";
  usb.pump(at(26));
  const Bytes head{0x01, 0x60};
  EXPECT_EQ(usb.output(), packet(101, 8,
                                 join({bulk_head(0x81, 0, 104),
                                       head,
                                       {sent.begin(), sent.begin() + 62},
                                       head,
                                       {sent.begin() + 62, sent.end()}})));
}

TEST_F(Plugged, AReadOfOnePacketIsFullWithIt) {
  chip.receive(Bytes(62, 0x11), kUsbStart);
  EXPECT_TRUE(chip.control({0x40, 9, 20, 0, 0}, kUsbStart));
  EXPECT_EQ(answer(packet(101, 9, bulk_head(0x81, 0, 64)), at(6)),
            packet(101, 9, join({bulk_head(0x81, 0, 64), {0x01, 0x60}, Bytes(62, 0x11)})));
}

TEST_F(Plugged, AWriteIsDoneWhenTheFifoHasTakenIt) {
  EXPECT_EQ(answer(packet(101, 1, join({bulk_head(0x02, 0, 2), {'O', 1}}))), packet(101, 1, bulk_head(0x02, 0, 2)));
  EXPECT_EQ(chip.sent(at(1)), (Bytes{'O', 1}));
  EXPECT_TRUE(answer(packet(101, 2, join({bulk_head(0x02, 0, 300), Bytes(300, 'x')})), at(1)).empty());
  EXPECT_TRUE(usb.next_event());
  usb.pump(at(10));
  EXPECT_EQ(usb.output(), packet(101, 2, bulk_head(0x02, 0, 300)));
  EXPECT_EQ(chip.sent(at(100)).size(), 300U);
}

TEST_F(Plugged, ACancelledReadIsGivenBack) {
  EXPECT_TRUE(answer(packet(101, 5, bulk_head(0x81, 0, 64))).empty());
  EXPECT_EQ(answer(packet(21, 5, {})), packet(101, 5, bulk_head(0x81, 1, 0)));
  EXPECT_TRUE(answer(packet(21, 5, {})).empty()) << "it is answered once";
}

TEST_F(Plugged, BytesMayComeInAnyPieces) {
  const Bytes all = join({packet(6, 1, {1}), packet(7, 2, {})});
  Bytes got;
  for (const std::uint8_t byte : all) {
    const Bytes part = answer({byte});
    got.insert(got.end(), part.begin(), part.end());
  }
  EXPECT_EQ(got, join({packet(8, 1, {0, 1}), packet(8, 2, {0, 1})}));
}

TEST_F(Plugged, PulledOutItGoesAndPluggedInItHasForgotten) {
  EXPECT_TRUE(answer(packet(101, 5, bulk_head(0x81, 0, 64))).empty());
  usb.unplug();
  EXPECT_EQ(usb.output(), packet(2, 0, {}));
  EXPECT_FALSE(usb.plugged());
  EXPECT_EQ(answer(packet(101, 6, bulk_head(0x81, 0, 64))), packet(101, 6, bulk_head(0x81, 4, 0)));
  usb.pump(at(50));
  EXPECT_TRUE(usb.output().empty()) << "what waited went with it";
  usb.plug(at(100));
  const Bytes out = usb.output();
  EXPECT_EQ(Bytes(out.end() - 26, out.end()), packet(1, 0, {1, 0, 0, 0, 0x03, 0x04, 0x01, 0x60, 0x00, 0x06}));
  EXPECT_EQ(chip.latency_ms(), 16);
}

}  // namespace
}  // namespace birdseye::hw_sim
