#include "drivers/io/ftdi_protocol.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace birdseye::drivers::ftdi {

namespace {

constexpr std::uint8_t kOut = 0x40, kIn = 0xC0;  // vendor requests to the device
constexpr double kMostBaudError = 0.03;

SetupPacket request(std::uint8_t direction, std::uint8_t number, unsigned value, unsigned index,
                    std::uint8_t reply_bytes = 0) {
  const auto low = [](unsigned word) { return static_cast<std::uint8_t>(word & 0xFF); };
  const auto high = [](unsigned word) { return static_cast<std::uint8_t>(word >> 8 & 0xFF); };
  return {direction, number, low(value), high(value), low(index), high(index), reply_bytes, 0};
}

unsigned optional_character(std::optional<std::uint8_t> character) {
  return character ? 0x100U | *character : 0U;
}

/// The nearest divisor that the chip has, in eighths; divisors between 1 and 2 other than 1.5 do not exist.
long nearest_eighths(double wanted, Chip chip) {
  const long eighths = std::max(8L, std::lround(wanted));
  if (eighths < 16) {
    const std::array<long, 3> kBelowTwo{8, 12, 16};
    return *std::min_element(kBelowTwo.begin(), kBelowTwo.end(), [&](long a, long b) {
      return std::abs(static_cast<double>(a) - wanted) < std::abs(static_cast<double>(b) - wanted);
    });
  }
  if (chip != Chip::am) return eighths;
  // The oldest chip knows the fractions 0, 1/8, 1/4 and 1/2 alone.
  const long whole = eighths / 8 * 8;
  const std::array<long, 5> kFractions{0, 1, 2, 4, 8};
  return whole + *std::min_element(kFractions.begin(), kFractions.end(), [&](long a, long b) {
           return std::abs(static_cast<double>(whole + a) - wanted) < std::abs(static_cast<double>(whole + b) - wanted);
         });
}

unsigned encode_eighths(long eighths) {
  constexpr std::array<unsigned, 8> kFractionCode{0, 3, 2, 4, 1, 5, 6, 7};
  if (eighths == 8) return 0;
  if (eighths == 12) return 1;
  return static_cast<unsigned>(eighths / 8) | kFractionCode[static_cast<std::size_t>(eighths % 8)] << 14;
}

}  // namespace

std::optional<Chip> chip_of(std::uint16_t bcd_device, bool has_serial) {
  switch (bcd_device) {
    case 0x0200:
      return has_serial ? Chip::am : Chip::bm;
    case 0x0400:
      return Chip::bm;
    case 0x0500:
      return Chip::ft2232c;
    case 0x0600:
      return Chip::ft232r;
    case 0x0700:
      return Chip::ft2232h;
    case 0x0800:
      return Chip::ft4232h;
    case 0x0900:
      return Chip::ft232h;
    case 0x1000:
      return Chip::ft_x;
    default:
      return std::nullopt;
  }
}

const char* name_of(Chip chip) {
  switch (chip) {
    case Chip::am:
      return "FT8U232AM";
    case Chip::bm:
      return "FT232BM";
    case Chip::ft2232c:
      return "FT2232C/D";
    case Chip::ft232r:
      return "FT232R";
    case Chip::ft2232h:
      return "FT2232H";
    case Chip::ft4232h:
      return "FT4232H";
    case Chip::ft232h:
      return "FT232H";
    case Chip::ft_x:
      return "FT-X";
  }
  return "?";
}

bool is_high_speed(Chip chip) {
  return chip == Chip::ft2232h || chip == Chip::ft4232h || chip == Chip::ft232h;
}

bool has_latency_timer(Chip chip) {
  return chip != Chip::am;
}

std::uint16_t port_index(Chip chip) {
  return chip == Chip::ft2232c || chip == Chip::ft2232h || chip == Chip::ft4232h ? 1 : 0;
}

SetupPacket reset(std::uint16_t port) {
  return request(kOut, 0x00, 0, port);
}

SetupPacket purge(Purge which, std::uint16_t port) {
  return request(kOut, 0x00, static_cast<unsigned>(which), port);
}

// Modem lines: the value's high byte says which to change, its low byte to what.
SetupPacket set_dtr(bool on, std::uint16_t port) {
  return request(kOut, 0x01, on ? 0x0101 : 0x0100, port);
}

SetupPacket set_rts(bool on, std::uint16_t port) {
  return request(kOut, 0x01, on ? 0x0202 : 0x0200, port);
}

SetupPacket set_flow_control(FlowControl flow, std::uint16_t port) {
  const unsigned characters = flow == FlowControl::xon_xoff ? 0x1311 : 0;
  return request(kOut, 0x02, characters, static_cast<unsigned>(flow) << 8 | port);
}

SetupPacket set_data_format(const DataFormat& format, std::uint16_t port) {
  const unsigned value = format.bits | static_cast<unsigned>(format.parity) << 8 |
                         static_cast<unsigned>(format.stop) << 11 | (format.send_break ? 1U << 14 : 0U);
  return request(kOut, 0x04, value, port);
}

SetupPacket set_event_character(std::optional<std::uint8_t> character, std::uint16_t port) {
  return request(kOut, 0x06, optional_character(character), port);
}

SetupPacket set_error_character(std::optional<std::uint8_t> character, std::uint16_t port) {
  return request(kOut, 0x07, optional_character(character), port);
}

SetupPacket set_latency(std::uint8_t ms, std::uint16_t port) {
  return request(kOut, 0x09, ms, port);
}

SetupPacket get_latency(std::uint16_t port) {
  return request(kIn, 0x0A, 0, port, 1);
}

Result<BaudRate> set_baud(int baud, Chip chip) {
  constexpr long kLargestWhole = 0x3FFF;
  double base = 3e6;
  unsigned select_fast_clock = 0;
  // The fast clock of an H chip counts further than the divisor goes for the slowest rates.
  if (is_high_speed(chip) && 12e6 / std::max(baud, 1) < static_cast<double>(kLargestWhole)) {
    base = 12e6;
    select_fast_clock = 1U << 17;
  }
  const long eighths = nearest_eighths(std::min(base * 8 / std::max(baud, 1), 1e6), chip);
  const double actual = base * 8 / static_cast<double>(eighths);
  if (baud <= 0 || eighths / 8 > kLargestWhole || std::abs(actual / baud - 1) > kMostBaudError) {
    return Error{Errc::bad_value, fmt::format("baud {} is not within reach of the chip {}", baud, name_of(chip))};
  }
  const unsigned divisor = encode_eighths(eighths) | select_fast_clock;
  // The bits that do not fit into the value go into the index: its low byte, unless that names the port.
  const bool shifted = is_high_speed(chip) || chip == Chip::ft2232c;
  const unsigned index = shifted ? (divisor >> 16) << 8 | port_index(chip) : divisor >> 16;
  return BaudRate{request(kOut, 0x03, divisor & 0xFFFF, index), actual};
}

std::optional<Piece> next_piece(std::span<const std::uint8_t>& transfer, std::size_t max_packet) {
  if (transfer.empty()) return std::nullopt;
  const auto packet = transfer.first(std::min(transfer.size(), max_packet));
  transfer = transfer.subspan(packet.size());
  if (packet.size() < 2) return Piece{};
  return Piece{packet[0], packet[1], packet.subspan(2)};
}

}  // namespace birdseye::drivers::ftdi
