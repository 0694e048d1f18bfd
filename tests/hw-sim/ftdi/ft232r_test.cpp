#include "hw-sim/ftdi/ft232r.hpp"

#include <gmock/gmock.h>

#include <bit>
#include <numeric>

#include "hw-sim/ftdi/descriptors.hpp"

namespace birdseye::hw_sim {
namespace {

using ::testing::ElementsAre;
using Bytes = std::vector<std::uint8_t>;

constexpr DeviceTime kStart{1'000'000'000};

DeviceTime after_ms(double ms) {
  return kStart + Duration::from_seconds(ms * 1e-3);
}

UsbSetup setup(const std::array<std::uint8_t, 8>& b) {
  const auto word = [&](std::size_t at) { return static_cast<std::uint16_t>(b[at] | b[at + 1] << 8U); };
  return {b[0], b[1], word(2), word(4), word(6)};
}

/// As an open driver leaves it: 115200 baud, a tick of the given length.
Ft232r chip_at_115200(int latency_ms, const Ft232rSettings& settings = {}) {
  Ft232r chip(settings);
  chip.power_up(kStart);
  EXPECT_TRUE(chip.control(setup({0x40, 3, 0x1A, 0, 0, 0, 0, 0}), kStart));
  EXPECT_TRUE(chip.control({0x40, 9, static_cast<std::uint16_t>(latency_ms), 0, 0}, kStart));
  return chip;
}

Bytes counting(std::size_t count) {
  Bytes bytes(count);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

/// Everything that comes until then, without the status bytes; `packets` counts the packets, `line` gathers line
/// status.
struct Drained {
  Bytes bytes;
  int packets = 0;
  std::uint8_t line = 0;
  DeviceTime last;  ///< packet with bytes in it
};
Drained drain(Ft232r& chip, DeviceTime until) {
  Drained all;
  for (DeviceTime time = std::max(chip.next_packet(), kStart); time <= until;
       time = std::max(chip.next_packet(), time)) {
    const auto packet = chip.packet(time);
    if (!packet) {
      ADD_FAILURE() << "no packet at the time it was promised for";
      break;
    }
    ++all.packets;
    all.line |= packet->at(1);
    all.bytes.insert(all.bytes.end(), packet->begin() + 2, packet->end());
    if (packet->size() > 2) all.last = time;
  }
  return all;
}

TEST(Ft232r, SaysWhatItIs) {
  Ft232r chip({.manufacturer = "FTDI", .product = "X", .serial = "A1"});
  EXPECT_THAT(*chip.control(setup({0x80, 6, 0, 1, 0, 0, 64, 0}), kStart),
              ElementsAre(18, 1, 0, 2, 0, 0, 0, 8, 0x03, 0x04, 0x01, 0x60, 0x00, 0x06, 1, 2, 3, 1));
  const auto configuration = chip.control(setup({0x80, 6, 0, 2, 0, 0, 255, 0}), kStart);
  EXPECT_THAT(*configuration, ElementsAre(9, 2, 32, 0, 1, 1, 0, 0xA0, 45,      //
                                          9, 4, 0, 0, 2, 0xFF, 0xFF, 0xFF, 2,  //
                                          7, 5, 0x81, 2, 64, 0, 0, 7, 5, 0x02, 2, 64, 0, 0));
  EXPECT_THAT(*chip.control(setup({0x80, 6, 3, 3, 0x09, 0x04, 255, 0}), kStart), ElementsAre(6, 3, 'A', 0, '1', 0));
  // No more than was asked for; and a full-speed device has no qualifier of its other speed.
  EXPECT_THAT(*chip.control(setup({0x80, 6, 0, 2, 0, 0, 4, 0}), kStart), ElementsAre(9, 2, 32, 0));
  EXPECT_FALSE(chip.control(setup({0x80, 6, 0, 6, 0, 0, 10, 0}), kStart));
}

TEST(Ft232r, DecodesTheDivisorsOfTheReference) {
  struct Row {
    std::uint16_t value, index;
    double baud;
  };
  constexpr Row kRows[] = {{0x04E2, 0, 2400},
                           {0x0271, 0, 4800},
                           {0x4138, 0, 9600},
                           {0x809C, 0, 19200},
                           {0xC04E, 0, 38400},
                           {0xC034, 0, 57553.96},
                           {0x0034, 0, 57692.31},
                           {0x001A, 0, 115384.62},
                           {0x000D, 0, 230769.23},
                           {0x4006, 0, 461538.46},
                           {0x8003, 0, 923076.92},
                           {0, 0, 3e6},
                           {1, 0, 2e6},
                           {0x0002, 1, 24e6 / 19},
                           {0xC002, 1, 24e6 / 23}};
  for (const Row& row : kRows) {
    Ft232r chip({});
    EXPECT_TRUE(chip.control({0x40, 3, row.value, row.index, 0}, kStart));
    EXPECT_NEAR(chip.baud(), row.baud, 0.01) << row.value;
  }
  Ft232r chip({});
  EXPECT_FALSE(chip.control({0x40, 3, 0x4000, 0, 0}, kStart)) << "a divisor below one";
}

TEST(Ft232r, TakesEveryRequestOfADriverAndNoneThatWritesItsEeprom) {
  Ft232r chip = chip_at_115200(16);
  for (const auto& bytes : std::vector<std::array<std::uint8_t, 8>>{{0x40, 0, 0, 0, 0, 0, 0, 0},
                                                                    {0x40, 0, 1, 0, 0, 0, 0, 0},
                                                                    {0x40, 0, 2, 0, 0, 0, 0, 0},
                                                                    {0x40, 2, 0, 0, 0, 0, 0, 0},
                                                                    {0x40, 2, 0x11, 0x13, 0, 4, 0, 0},
                                                                    {0x40, 4, 8, 0, 0, 0, 0, 0},
                                                                    {0x40, 4, 8, 0x40, 0, 0, 0, 0},
                                                                    {0x40, 6, 0, 0, 0, 0, 0, 0},
                                                                    {0x40, 7, 0, 0, 0, 0, 0, 0},
                                                                    {0x40, 0x0B, 0, 0, 0, 0, 0, 0}}) {
    EXPECT_THAT(chip.control(setup(bytes), kStart), ::testing::Optional(Bytes{})) << int{bytes[1]};
  }
  EXPECT_THAT(*chip.control(setup({0xC0, 5, 0, 0, 0, 0, 2, 0}), kStart), ElementsAre(0x01, 0x60));
  EXPECT_THAT(*chip.control(setup({0xC0, 0x0A, 0, 0, 0, 0, 1, 0}), kStart), ElementsAre(16));
  EXPECT_FALSE(chip.control(setup({0x40, 0x91, 0, 0, 0, 0, 0, 0}), kStart));
  EXPECT_FALSE(chip.control(setup({0x40, 0x92, 0, 0, 0, 0, 0, 0}), kStart));
  EXPECT_FALSE(chip.control(setup({0x40, 9, 0, 0, 0, 0, 0, 0}), kStart)) << "a tick of 0 ms";
}

TEST(Ft232r, ItsEepromHoldsItsIdentityAndAChecksum) {
  Ft232r chip({.serial = "CART0001"});
  Bytes image;
  for (std::uint16_t word = 0; word < 64; ++word) {
    const auto bytes = chip.control({0xC0, 0x90, 0, word, 2}, kStart);
    image.insert(image.end(), bytes->begin(), bytes->end());
  }
  EXPECT_EQ(Bytes(image.begin() + 2, image.begin() + 8), (Bytes{0x03, 0x04, 0x01, 0x60, 0x00, 0x06}));
  // The serial number is where its entry says, as long as that says.
  const std::size_t at = image[18] - 0x80U;
  EXPECT_EQ(image[19], 18);
  EXPECT_EQ(image[at], 18);
  EXPECT_EQ(image[at + 2], 'C');
  EXPECT_EQ(image[at + 16], '1');
  std::uint16_t sum = 0xAAAA;
  for (std::size_t i = 0; i < 126; i += 2)
    sum = std::rotl(static_cast<std::uint16_t>(sum ^ (image[i] | image[i + 1] << 8U)), 1);
  EXPECT_EQ(sum, image[126] | image[127] << 8U);
}

TEST(Ft232r, ModemLinesAreSetByMaskAndDroppedByReset) {
  Ft232r chip = chip_at_115200(1);
  const auto lines = [&](std::uint16_t value) {
    EXPECT_TRUE(chip.control({0x40, 1, value, 0, 0}, kStart));
    return std::pair(chip.dtr(), chip.rts());
  };
  EXPECT_EQ(lines(0x0303), std::pair(true, true));
  EXPECT_EQ(lines(0x0200), std::pair(true, false));
  EXPECT_EQ(lines(0x0003), std::pair(true, false)) << "nothing was to change";
  EXPECT_EQ(lines(0x0302), std::pair(false, true));
  EXPECT_TRUE(chip.control({0x40, 0, 0, 0, 0}, kStart));
  EXPECT_FALSE(chip.dtr() || chip.rts());
  EXPECT_NEAR(chip.baud(), 115384.6, 0.1) << "the speed survives";
}

TEST(Ft232r, AnIdleLineGivesTwoBytesATick) {
  Ft232r chip({});
  chip.power_up(kStart);
  EXPECT_FALSE(chip.packet(after_ms(15.9)));
  EXPECT_THAT(*chip.packet(after_ms(16)), ElementsAre(0x01, 0x60));
  EXPECT_FALSE(chip.packet(after_ms(16)));
  EXPECT_EQ(drain(chip, after_ms(16 + 160)).packets, 10);
  EXPECT_TRUE(chip.control({0x40, 9, 1, 0, 0}, after_ms(200)));
  EXPECT_EQ(drain(chip, after_ms(300)).packets, 100);
}

TEST(Ft232r, BytesTakeTheirTimeOnTheLineAndWaitForTheTick) {
  Ft232r chip = chip_at_115200(16);
  chip.receive(Bytes{7, 8, 9}, kStart);
  EXPECT_FALSE(chip.packet(after_ms(15)));
  EXPECT_THAT(*chip.packet(after_ms(16)), ElementsAre(0x01, 0x60, 7, 8, 9));
  // 62 do not wait; the last of them has left the line after 5.37 ms.
  chip.receive(counting(62), after_ms(16));
  EXPECT_FALSE(chip.packet(after_ms(16 + 5.36)));
  const auto packet = chip.packet(after_ms(16 + 5.38));
  ASSERT_TRUE(packet);
  EXPECT_EQ(packet->size(), 64U);
  EXPECT_EQ(packet->back(), 61);
}

TEST(Ft232r, AStreamTakesAsLongAsOnTheWireAndLosesNothing) {
  Ft232r chip = chip_at_115200(1);
  const Bytes sent = counting(20000);
  chip.receive(sent, kStart);
  const Drained got = drain(chip, after_ms(2000));
  EXPECT_EQ(got.bytes, sent);
  EXPECT_EQ(got.line, 0x60);
  EXPECT_NEAR((got.last - kStart).seconds(), 20000 * 10 / 115384.6, 1e-3);
}

TEST(Ft232r, AnEventCharacterShipsWhatThereIs) {
  Ft232r chip = chip_at_115200(16);
  EXPECT_TRUE(chip.control({0x40, 6, 0x010D, 0, 0}, kStart));
  chip.receive(Bytes{'o', 'k', 0x0D}, kStart);
  EXPECT_FALSE(chip.packet(after_ms(0.2)));
  EXPECT_THAT(*chip.packet(after_ms(0.3)), ElementsAre(0x01, 0x60, 'o', 'k', 0x0D));
}

TEST(Ft232r, AHostThatDoesNotReadLosesBytesAndIsTold) {
  Ft232r chip = chip_at_115200(1);
  chip.receive(counting(200), kStart);
  const Drained got = drain(chip, kStart);
  EXPECT_EQ(got.packets, 0);
  const auto first = chip.packet(after_ms(100));
  EXPECT_EQ(first->size(), 64U);
  EXPECT_EQ(first->at(1), 0x62);
  const Drained rest = drain(chip, after_ms(200));
  EXPECT_EQ(rest.bytes.size(), 128U - 62);
  EXPECT_EQ(rest.bytes.back(), 127);
  EXPECT_EQ(rest.line, 0x60) << "told once";
}

TEST(Ft232r, DamageIsToldOfThePacketItIsIn) {
  constexpr std::pair<LineError, std::uint8_t> kRows[] = {
      {LineError::overrun, 0x62}, {LineError::parity, 0x64}, {LineError::framing, 0x68}, {LineError::line_break, 0x70}};
  for (const auto& [error, status] : kRows) {
    Ft232r chip = chip_at_115200(1);
    chip.damage(error);
    chip.receive(Bytes{0x55, 0x66}, kStart);
    const auto packet = chip.packet(after_ms(1));
    EXPECT_EQ(packet->at(1), status);
    EXPECT_EQ(packet->size(), error == LineError::overrun ? 3U : 4U);
    EXPECT_EQ(packet->back(), 0x66);
    if (error == LineError::line_break) {
      EXPECT_EQ(packet->at(2), 0);
    }
    EXPECT_EQ(chip.packet(after_ms(2))->at(1), 0x60);
  }
}

TEST(Ft232r, PurgesTheDirectionItIsTold) {
  Ft232r chip = chip_at_115200(1);
  chip.receive(Bytes{1, 2, 3}, kStart);
  EXPECT_EQ(chip.take(Bytes{4, 5}, kStart), 2U);
  EXPECT_TRUE(chip.control({0x40, 0, 1, 0, 0}, kStart));
  EXPECT_TRUE(chip.sent(after_ms(5)).empty());
  EXPECT_THAT(*chip.packet(after_ms(5)), ElementsAre(0x01, 0x60, 1, 2, 3));
  chip.receive(Bytes{1, 2, 3}, after_ms(5));
  EXPECT_TRUE(chip.control({0x40, 0, 2, 0, 0}, after_ms(6)));
  EXPECT_THAT(*chip.packet(after_ms(7)), ElementsAre(0x01, 0x60));
}

TEST(Ft232r, CommandsLeaveByteByByteAndFillTheFifo) {
  Ft232r chip = chip_at_115200(1);
  EXPECT_EQ(chip.take(counting(300), kStart), 256U);
  EXPECT_THAT(*chip.packet(after_ms(1)), ElementsAre(0x01, 0x00));
  chip = chip_at_115200(1);
  EXPECT_EQ(chip.take(Bytes{'B'}, kStart), 1U);
  EXPECT_TRUE(chip.sent(after_ms(0.08)).empty());
  EXPECT_EQ(chip.next_sent(), kStart + Duration{86'666});
  EXPECT_THAT(chip.sent(after_ms(0.09)), ElementsAre('B'));
  EXPECT_FALSE(chip.next_sent());
}

TEST(Ft232r, AtTheWrongSpeedNeitherUnderstandsTheOther) {
  Ft232r chip = chip_at_115200(1, {.line_baud = 57600});
  EXPECT_EQ(chip.take(Bytes{'B'}, kStart), 1U);
  EXPECT_TRUE(chip.sent(after_ms(5)).empty());
  chip.receive(Bytes{0x55}, after_ms(5));
  const auto packet = chip.packet(after_ms(7));
  EXPECT_EQ(packet->at(1), 0x68);
  EXPECT_NE(packet->at(2), 0x55);
}

}  // namespace
}  // namespace birdseye::hw_sim
