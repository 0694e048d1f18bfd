#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "calibration/base/result.hpp"
#include "drivers/io/usb_port.hpp"

/// What FTDI's adapters understand, as bytes; no I/O. Sources: the Linux driver ftdi_sio and libftdi.
namespace birdseye::drivers::ftdi {

enum class Chip { am, bm, ft2232c, ft232r, ft2232h, ft4232h, ft232h, ft_x };

/// Which chip it is, by bcdDevice; the product number says less, since vendors change it. has_serial tells a BM without
/// a valid EEPROM, which calls itself an AM but has no serial number string. Empty for a chip that is not known here.
std::optional<Chip> chip_of(std::uint16_t bcd_device, bool has_serial);
const char* name_of(Chip chip);
bool is_high_speed(Chip chip);
/// False for an AM, which passes its bytes on as it likes.
bool has_latency_timer(Chip chip);
/// The index that requests for the chip's first port carry: 1 where there are several ports, else 0.
std::uint16_t port_index(Chip chip);

enum class Purge : std::uint8_t { first = 1, second = 2 };  // sources disagree on which is which: send both
enum class Parity : std::uint8_t { none = 0, odd = 1, even = 2, mark = 3, space = 4 };
enum class StopBits : std::uint8_t { one = 0, one_and_a_half = 1, two = 2 };
enum class FlowControl : std::uint8_t { none = 0, rts_cts = 1, dtr_dsr = 2, xon_xoff = 4 };
struct DataFormat {
  std::uint8_t bits = 8;
  Parity parity = Parity::none;
  StopBits stop = StopBits::one;
  bool send_break = false;
};

// Requests. port: port_index() of the chip.
SetupPacket reset(std::uint16_t port = 0);
SetupPacket purge(Purge which, std::uint16_t port = 0);
SetupPacket set_dtr(bool on, std::uint16_t port = 0);
SetupPacket set_rts(bool on, std::uint16_t port = 0);
SetupPacket set_flow_control(FlowControl flow, std::uint16_t port = 0);
SetupPacket set_data_format(const DataFormat& format, std::uint16_t port = 0);
SetupPacket set_event_character(std::optional<std::uint8_t> character, std::uint16_t port = 0);
SetupPacket set_error_character(std::optional<std::uint8_t> character, std::uint16_t port = 0);
SetupPacket set_latency(std::uint8_t ms, std::uint16_t port = 0);
SetupPacket get_latency(std::uint16_t port = 0);

struct BaudRate {
  SetupPacket request;
  double actual;  ///< what the divisor gives, bit/s
};
/// Errc::bad_value when no divisor of the chip comes within 3 % of baud; a frame of ten bits still bears 3 %.
Result<BaudRate> set_baud(int baud, Chip chip);

/// One packet of a bulk IN transfer, taken apart.
struct Piece {
  std::uint8_t modem = 0;
  std::uint8_t line = 0;
  std::span<const std::uint8_t> payload;
  /// An overrun, parity, framing error or break befell some byte of the packet; nobody knows which.
  [[nodiscard]] bool damaged() const { return (line & 0x1E) != 0; }
};
/// Cuts the next piece off a transfer, of which each max_packet bytes begin with two status bytes of their own. Empty
/// when nothing is left. A rest of one byte, which no chip sends, gives an empty piece.
std::optional<Piece> next_piece(std::span<const std::uint8_t>& transfer, std::size_t max_packet);

}  // namespace birdseye::drivers::ftdi
