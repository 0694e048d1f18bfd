#include "drivers/io/ftdi_protocol.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "drivers/io/ftdi_receiver.hpp"

namespace birdseye::drivers {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ftdi::Chip;
using ::testing::ElementsAre;

// The vectors are those of the adapter's description by others than this driver (its Linux driver, libftdi and QEMU's
// model agree on them), not captures of a bus.

TEST(FtdiRequests, AreTheVectorsByteForByte) {
  EXPECT_THAT(ftdi::reset(), ElementsAre(0x40, 0, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::purge(ftdi::Purge::first), ElementsAre(0x40, 0, 1, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::purge(ftdi::Purge::second), ElementsAre(0x40, 0, 2, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_dtr(true), ElementsAre(0x40, 1, 0x01, 0x01, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_dtr(false), ElementsAre(0x40, 1, 0x00, 0x01, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_rts(true), ElementsAre(0x40, 1, 0x02, 0x02, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_rts(false), ElementsAre(0x40, 1, 0x00, 0x02, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_flow_control(ftdi::FlowControl::none), ElementsAre(0x40, 2, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_flow_control(ftdi::FlowControl::rts_cts), ElementsAre(0x40, 2, 0, 0, 0, 1, 0, 0));
  EXPECT_THAT(ftdi::set_flow_control(ftdi::FlowControl::xon_xoff), ElementsAre(0x40, 2, 0x11, 0x13, 0, 4, 0, 0));
  EXPECT_THAT(ftdi::set_event_character({}), ElementsAre(0x40, 6, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_event_character(0x0D), ElementsAre(0x40, 6, 0x0D, 1, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_error_character({}), ElementsAre(0x40, 7, 0, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_latency(1), ElementsAre(0x40, 9, 1, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_latency(2), ElementsAre(0x40, 9, 2, 0, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::get_latency(), ElementsAre(0xC0, 0x0A, 0, 0, 0, 0, 1, 0));
}

TEST(FtdiRequests, DataFormatsAreTheVectors) {
  EXPECT_THAT(ftdi::set_data_format({}), ElementsAre(0x40, 4, 0x08, 0x00, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_data_format({7, ftdi::Parity::even, ftdi::StopBits::one, false}),
              ElementsAre(0x40, 4, 0x07, 0x02, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_data_format({8, ftdi::Parity::none, ftdi::StopBits::two, false}),
              ElementsAre(0x40, 4, 0x08, 0x10, 0, 0, 0, 0));
  EXPECT_THAT(ftdi::set_data_format({8, ftdi::Parity::none, ftdi::StopBits::one, true}),
              ElementsAre(0x40, 4, 0x08, 0x40, 0, 0, 0, 0));
}

TEST(FtdiRequests, NameThePortOfAChipThatHasSeveral) {
  EXPECT_EQ(ftdi::port_index(Chip::ft232r), 0);
  EXPECT_EQ(ftdi::port_index(Chip::ft232h), 0);
  EXPECT_EQ(ftdi::port_index(Chip::ft2232h), 1);
  EXPECT_THAT(ftdi::set_flow_control(ftdi::FlowControl::rts_cts, 1), ElementsAre(0x40, 2, 0, 0, 1, 1, 0, 0));
  EXPECT_THAT(ftdi::set_latency(1, 1), ElementsAre(0x40, 9, 1, 0, 1, 0, 0, 0));
}

TEST(FtdiBaud, IsTheTableForFullSpeedChips) {
  struct Row {
    int baud;
    std::uint8_t low, high;
    double actual;
  };
  for (const Row& row :
       {Row{2400, 0xE2, 0x04, 2400.00}, Row{4800, 0x71, 0x02, 4800.00}, Row{9600, 0x38, 0x41, 9600.00},
        Row{19200, 0x9C, 0x80, 19200.00}, Row{38400, 0x4E, 0xC0, 38400.00}, Row{57600, 0x34, 0xC0, 57553.96},
        Row{115200, 0x1A, 0x00, 115384.62}, Row{230400, 0x0D, 0x00, 230769.23}, Row{460800, 0x06, 0x40, 461538.46},
        Row{921600, 0x03, 0x80, 923076.92}}) {
    for (const Chip chip : {Chip::bm, Chip::ft232r, Chip::ft_x}) {
      const auto set = ftdi::set_baud(row.baud, chip);
      ASSERT_TRUE(set) << row.baud;
      EXPECT_THAT(set->request, ElementsAre(0x40, 3, row.low, row.high, 0, 0, 0, 0)) << row.baud;
      EXPECT_NEAR(set->actual, row.actual, 0.005);
    }
  }
}

TEST(FtdiBaud, PutsTheHighBitsWhereTheChipLooksForThem) {
  // A fast chip's port A.
  EXPECT_THAT(ftdi::set_baud(115200, Chip::ft2232h)->request, ElementsAre(0x40, 3, 0x68, 0xC0, 0x01, 0x02, 0, 0));
  EXPECT_NEAR(ftdi::set_baud(115200, Chip::ft2232h)->actual, 115246.10, 0.005);
  EXPECT_THAT(ftdi::set_baud(115200, Chip::ft232h)->request, ElementsAre(0x40, 3, 0x68, 0xC0, 0x00, 0x02, 0, 0));
  // Too slow for the fast clock: as the older chips do it.
  EXPECT_THAT(ftdi::set_baud(300, Chip::ft2232h)->request, ElementsAre(0x40, 3, 0x10, 0x27, 0x01, 0x00, 0, 0));
  // Three eighths has bit 16: 3e6 / 10.375.
  EXPECT_THAT(ftdi::set_baud(289157, Chip::ft232r)->request, ElementsAre(0x40, 3, 0x0A, 0x00, 0x01, 0x00, 0, 0));
  EXPECT_THAT(ftdi::set_baud(289157, Chip::ft2232c)->request, ElementsAre(0x40, 3, 0x0A, 0x00, 0x01, 0x01, 0, 0));
}

TEST(FtdiBaud, AgreesWithADecoderForEveryRateInReach) {
  // An emulator's way back: the inverse of the fraction codes, and the two special divisors.
  const auto decode = [](const SetupPacket& request) {
    constexpr std::array<int, 8> kEighths{0, 4, 2, 1, 3, 5, 6, 7};
    const int value = request[2] | request[3] << 8;
    const int whole = value & 0x3FFF, code = value >> 14 | (request[4] & 1) << 2;
    if (whole < 2 && code == 0) return whole == 0 ? 3e6 : 2e6;
    return 24e6 / (8 * whole + kEighths[static_cast<std::size_t>(code)]);
  };
  for (int baud = 200; baud <= 3'000'000; baud += baud / 37 + 1) {
    const auto set = ftdi::set_baud(baud, Chip::ft232r);
    if (!set) {
      EXPECT_GT(baud, 1'500'000);  // between the divisors 1 and 2 there is little
      continue;
    }
    EXPECT_NEAR(decode(set->request), set->actual, 1e-6) << baud;
    EXPECT_LE(std::abs(set->actual / baud - 1), 0.03) << baud;
    // Below the special divisors the nearest eighth is never further off than half an eighth of 2.
    if (baud <= 1'500'000) {
      EXPECT_LE(std::abs(24e6 / set->actual - 24e6 / baud), 0.5 + 1e-9) << baud;
    }
  }
}

TEST(FtdiBaud, TheOldestChipHasFourFractions) {
  for (const int baud : {2400, 4800, 9600, 19200, 38400, 57600, 115200}) {
    EXPECT_EQ(ftdi::set_baud(baud, Chip::am)->request, ftdi::set_baud(baud, Chip::bm)->request) << baud;
  }
  // 10.375 is not among them; 10.25 (8000) is as near as 10.5 (4000).
  EXPECT_EQ(ftdi::set_baud(289157, Chip::am)->request[4], 0);
}

TEST(FtdiBaud, RefusesWhatIsOutOfReach) {
  for (const int baud : {-9600, 0, 100, 1'700'000, 4'000'000}) {
    const auto set = ftdi::set_baud(baud, Chip::ft232r);
    ASSERT_FALSE(set) << baud;
    EXPECT_EQ(set.error().code, Errc::bad_value);
    EXPECT_THAT(set.error().what, ::testing::HasSubstr("FT232R"));
  }
  EXPECT_TRUE(ftdi::set_baud(3'000'000, Chip::ft232r));
  EXPECT_TRUE(ftdi::set_baud(2'000'000, Chip::ft232r));
  EXPECT_TRUE(ftdi::set_baud(12'000'000, Chip::ft232h));
}

TEST(FtdiChip, IsToldByTheDeviceNumber) {
  EXPECT_EQ(ftdi::chip_of(0x0200, true), Chip::am);
  EXPECT_EQ(ftdi::chip_of(0x0200, false), Chip::bm);
  EXPECT_EQ(ftdi::chip_of(0x0400, true), Chip::bm);
  EXPECT_EQ(ftdi::chip_of(0x0500, true), Chip::ft2232c);
  EXPECT_EQ(ftdi::chip_of(0x0600, true), Chip::ft232r);
  EXPECT_EQ(ftdi::chip_of(0x0700, true), Chip::ft2232h);
  EXPECT_EQ(ftdi::chip_of(0x0800, true), Chip::ft4232h);
  EXPECT_EQ(ftdi::chip_of(0x0900, true), Chip::ft232h);
  EXPECT_EQ(ftdi::chip_of(0x1000, true), Chip::ft_x);
  EXPECT_FALSE(ftdi::chip_of(0x0300, true));
  EXPECT_FALSE(ftdi::chip_of(0x2800, true));
}

const Bytes kU5{0x31, 0x60, 0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x2A, 0x75, 0x00, 0x20, 0xD5, 0x12,
                0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x58, 0x75, 0x00, 0x20, 0xC7, 0x13, 0x55, 0x76, 0x2A, 0x05,
                0x00, 0x10, 0x05, 0x76, 0x00, 0x20, 0xB9, 0x14, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x33, 0x76,
                0x00, 0x20, 0xAA, 0x15, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x60, 0x76, 0x00, 0x20, 0x9C, 0x16,
                0x31, 0x60, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x0E, 0x77, 0x00, 0x20};

/// All that a reader can get by now.
Bytes take_all(FtdiReceiver& receiver) {
  Bytes all, chunk(1024);
  for (std::size_t got = 0; (got = receiver.take(chunk).bytes) > 0;)
    all.insert(all.end(), chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(got));
  return all;
}

TEST(FtdiReceiver, StripsTheStatusOfEveryPacketInATransfer) {
  FtdiReceiver receiver(64, 4096);
  receiver.push(kU5, {});
  Bytes payload(kU5.begin() + 2, kU5.begin() + 64);
  payload.insert(payload.end(), kU5.begin() + 66, kU5.end());
  EXPECT_EQ(payload.size(), 72U);
  EXPECT_EQ(take_all(receiver), payload);
  EXPECT_EQ(receiver.errors_passed(), 0U);
}

TEST(FtdiReceiver, AFullPacketAndTheEmptyOneThatClosesIt) {
  FtdiReceiver receiver(64, 4096);
  Bytes transfer(kU5.begin(), kU5.begin() + 64);
  transfer.insert(transfer.end(), {0x31, 0x60});
  receiver.push(transfer, {});
  EXPECT_EQ(take_all(receiver), Bytes(kU5.begin() + 2, kU5.begin() + 64));
}

TEST(FtdiReceiver, IdlePacketsAreNothing) {
  FtdiReceiver receiver(64, 4096);
  receiver.push(Bytes{0x31, 0x60}, {});
  receiver.push(Bytes{}, {});
  EXPECT_TRUE(receiver.empty());
  receiver.push(Bytes{0x31, 0x60, 0x08}, {});
  receiver.push(Bytes{0x31, 0x60, 0xD0}, {});
  receiver.push(Bytes{0x31, 0x60}, {});
  EXPECT_EQ(take_all(receiver), (Bytes{0x08, 0xD0}));
}

TEST(FtdiReceiver, DropsAnOverrunPacketAndSaysSoWithTheBytesBehindIt) {
  const Bytes overrun{0x31, 0x62, 0xE3, 0x11, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x2A, 0x05, 0x00, 0x10, 0x58, 0x75,
                      0x00, 0x20, 0xC7, 0x13, 0x55, 0x76, 0x2A, 0x05, 0x00, 0x10, 0x05, 0x76, 0x00, 0x20};
  FtdiReceiver receiver(64, 4096);
  receiver.push(Bytes{0x31, 0x60, 0xAA}, {});
  receiver.push(overrun, {});
  receiver.push(Bytes{0x31, 0x60, 0xBB}, {});
  Bytes chunk(64);
  EXPECT_EQ(receiver.take(chunk).bytes, 1U);
  EXPECT_EQ(chunk[0], 0xAA);
  EXPECT_EQ(receiver.errors_passed(), 0U);  // the byte before the hole is sound, and is told to be
  EXPECT_EQ(receiver.take(chunk).bytes, 1U);
  EXPECT_EQ(chunk[0], 0xBB);
  EXPECT_EQ(receiver.errors_passed(), 1U);
  EXPECT_EQ(receiver.counters().damaged_packets, 1U);
}

TEST(FtdiReceiver, TellsDamageByTheErrorBitsAlone) {
  for (const std::uint8_t line : Bytes{0x62, 0x64, 0x68, 0x70, 0xE8}) {
    FtdiReceiver receiver(64, 4096);
    receiver.push(Bytes{0x31, line, 0x55}, {});
    EXPECT_TRUE(receiver.empty()) << int{line};
    EXPECT_EQ(receiver.take({}).bytes, 0U);
    EXPECT_EQ(receiver.errors_passed(), 1U) << int{line};
  }
  for (const std::uint8_t line : Bytes{0x60, 0x00, 0x20, 0x61}) {
    for (const std::uint8_t modem : Bytes{0x00, 0x01, 0x02, 0x31, 0xB1, 0xFF}) {
      FtdiReceiver receiver(64, 4096);
      receiver.push(Bytes{modem, line, 0x55}, {});
      EXPECT_EQ(take_all(receiver), Bytes{0x55}) << int{line};
      EXPECT_EQ(receiver.errors_passed(), 0U) << int{line};
    }
  }
}

TEST(FtdiReceiver, ErrorsInEmptyPacketsAreCountedAndDoNothing) {
  FtdiReceiver receiver(64, 4096);
  receiver.push(Bytes(kU5.begin(), kU5.begin() + 8), {});  // status and half a record
  for (int i = 0; i < 3; ++i) receiver.push(Bytes{0x31, 0x64}, {});
  Bytes rest{0x31, 0x60};
  rest.insert(rest.end(), kU5.begin() + 8, kU5.begin() + 14);
  receiver.push(rest, {});
  EXPECT_EQ(take_all(receiver), Bytes(kU5.begin() + 2, kU5.begin() + 14));
  EXPECT_EQ(receiver.errors_passed(), 0U);
  EXPECT_EQ(receiver.counters().empty_errors, 3U);
}

/// A chip's rendering of a payload: into packets of 0 to 62 bytes, and those into transfers, which end at a packet that
/// is not full. next: a number from 0 to its argument.
template <typename Next>
std::vector<Bytes> packetise(const Bytes& payload, std::size_t max_packet, Next next) {
  std::vector<Bytes> transfers(1);
  for (std::size_t at = 0; at < payload.size();) {
    const std::size_t count = std::min(next(max_packet - 2), payload.size() - at);
    Bytes& transfer = transfers.back();
    transfer.insert(transfer.end(), {0x01, 0x60});
    transfer.insert(transfer.end(), payload.begin() + static_cast<std::ptrdiff_t>(at),
                    payload.begin() + static_cast<std::ptrdiff_t>(at + count));
    at += count;
    if (count < max_packet - 2 || next(3) == 0) transfers.emplace_back();
  }
  return transfers;
}

TEST(FtdiReceiver, AnySplitOfAPayloadIntoPacketsGivesThePayloadBack) {
  std::mt19937 random(20261121);
  for (int round = 0; round < 400; ++round) {
    const std::size_t max_packet = round % 2 == 0 ? 64 : 512;
    Bytes payload(std::uniform_int_distribution<std::size_t>(0, 4000)(random));
    for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random());
    const bool mostly_full = round % 3 == 0;
    const auto next = [&](std::size_t most) {
      if (mostly_full && random() % 4 != 0) return most;
      return std::uniform_int_distribution<std::size_t>(0, most)(random);
    };
    FtdiReceiver receiver(max_packet, 1U << 20);
    Bytes got;
    for (const Bytes& transfer : packetise(payload, max_packet, next)) {
      receiver.push(transfer, {});
      if (random() % 2 == 0) {
        const Bytes some = take_all(receiver);
        got.insert(got.end(), some.begin(), some.end());
      }
    }
    const Bytes rest = take_all(receiver);
    got.insert(got.end(), rest.begin(), rest.end());
    ASSERT_EQ(got, payload) << "round " << round;
  }
}

TEST(FtdiReceiver, EveryBoundaryOfOneTransferIsStripped) {
  // A payload of n bytes in as few packets as it takes, for every n around the first packets' ends.
  for (std::size_t n = 0; n <= 3 * 62 + 2; ++n) {
    Bytes payload(n);
    for (std::size_t i = 0; i < n; ++i) payload[i] = static_cast<std::uint8_t>(i * 7 + 1);
    Bytes transfer;
    for (std::size_t at = 0; at <= n; at += 62) {
      transfer.insert(transfer.end(), {0xB1, 0x00});
      for (std::size_t i = at; i < std::min(n, at + 62); ++i) transfer.push_back(payload[i]);
    }
    FtdiReceiver receiver(64, 4096);
    receiver.push(transfer, {});
    ASSERT_EQ(take_all(receiver), payload) << n;
  }
}

TEST(FtdiReceiver, GivesEachPacketItsOwnTimeHoweverItIsRead) {
  FtdiReceiver receiver(64, 4096);
  receiver.push(Bytes{0x01, 0x60, 1, 2, 3}, {1000});
  receiver.push(Bytes{0x01, 0x60, 4}, {2000});
  Bytes two(2);
  EXPECT_EQ(receiver.take(two).arrived.ns, 1000);
  const auto rest = receiver.take(two);
  EXPECT_EQ(rest.bytes, 1U);  // not also the next packet's: it came later
  EXPECT_EQ(rest.arrived.ns, 1000);
  EXPECT_EQ(receiver.take(two).arrived.ns, 2000);
}

TEST(FtdiReceiver, AFullStoreIsOneHoleAndThenTheNewest) {
  FtdiReceiver receiver(64, 100);
  Bytes packet(52, 0x60);
  for (std::uint8_t i = 1; i <= 3; ++i) {
    packet[2] = i;
    receiver.push(packet, {});
  }
  EXPECT_EQ(receiver.errors_passed(), 0U);
  EXPECT_EQ(receiver.counters().overflows, 1U);
  Bytes chunk(64);
  EXPECT_EQ(receiver.take(chunk).bytes, 50U);
  EXPECT_EQ(chunk[0], 3);
  EXPECT_EQ(receiver.errors_passed(), 1U);
  EXPECT_TRUE(receiver.empty());
}

TEST(FtdiReceiver, ALostTransferIsAHole) {
  FtdiReceiver receiver(64, 100);
  receiver.push(Bytes{0x01, 0x60, 1}, {});
  receiver.push_failed();
  Bytes chunk(64);
  EXPECT_EQ(receiver.take(chunk).bytes, 1U);
  EXPECT_EQ(receiver.errors_passed(), 0U);
  EXPECT_EQ(receiver.take(chunk).bytes, 0U);
  EXPECT_EQ(receiver.errors_passed(), 1U);
}

}  // namespace
}  // namespace birdseye::drivers
