#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/time/clock.hpp"

namespace birdseye::hw_sim {

/// What can befall a byte on its way through the chip, as bits of the line status.
enum class LineError : std::uint8_t { overrun = 0x02, parity = 0x04, framing = 0x08, line_break = 0x10 };

/// The eight bytes that open a USB control transfer.
struct UsbSetup {
  std::uint8_t request_type = 0, request = 0;
  std::uint16_t value = 0, index = 0, length = 0;
};

struct Ft232rSettings {
  std::string manufacturer = "FTDI", product = "FT232R USB UART", serial = "BE0SIM01";
  std::size_t receive_fifo_bytes = 128;  ///< line to host
  std::size_t transmit_fifo_bytes = 256;
  double line_baud = 115200;  ///< what the instrument at the other end of the line speaks
};

/// An FT232R: USB on one side, a serial line of 8N1 on the other. It has no USB and no clock of its own: every call
/// tells the time, which may not go back. Its answers are those of the chip rather than of QEMU's usb-serial: two
/// status bytes at each tick of the latency timer, bytes that take their time on the line, fifos that overrun, an
/// EEPROM to read.
class Ft232r {
 public:
  static constexpr std::size_t kPacket = 64;

  explicit Ft232r(const Ft232rSettings& settings);

  /// Power on: all that the host has set is lost.
  void power_up(DeviceTime now);

  /// Answers a control transfer. No request of the chip has data on its way out, so none are passed. Returns the bytes
  /// for the host (none for an out transfer); empty where the chip refuses with a stall.
  std::optional<std::vector<std::uint8_t>> control(const UsbSetup& setup, DeviceTime now);
  /// Takes bytes for the line, as many as there is room for, and returns how many.
  std::size_t take(std::span<const std::uint8_t> bytes, DeviceTime now);
  /// The next packet for the host, if one is due: full, or at the latency timer's tick with what there is.
  std::optional<std::vector<std::uint8_t>> packet(DeviceTime now);
  /// When packet() next has something, if nothing new comes from the line.
  [[nodiscard]] DeviceTime next_packet() const;

  /// The instrument sends; each byte takes its time after those before it.
  void receive(std::span<const std::uint8_t> bytes, DeviceTime now);
  /// What has left on the line since the last call, as the instrument gets it.
  std::vector<std::uint8_t> sent(DeviceTime now);
  /// When sent() next has something, if there is anything to send.
  [[nodiscard]] std::optional<DeviceTime> next_sent() const;
  /// The next byte from the line shall arrive damaged. An overrun loses it.
  void damage(LineError error) { damage_ |= static_cast<std::uint8_t>(error); }

  [[nodiscard]] bool rts() const { return rts_; }
  [[nodiscard]] bool dtr() const { return dtr_; }
  [[nodiscard]] double baud() const { return baud_; }
  [[nodiscard]] int latency_ms() const { return latency_ms_; }
  [[nodiscard]] const Ft232rSettings& settings() const { return settings_; }

 private:
  struct Arriving {
    std::uint8_t byte;
    DeviceTime handed;
  };

  void advance(DeviceTime now);
  void arrive(std::uint8_t byte);
  void purge_receive();
  bool set(const UsbSetup& setup, DeviceTime now);
  bool set_baud(const UsbSetup& setup);
  std::optional<std::vector<std::uint8_t>> get(const UsbSetup& setup) const;
  [[nodiscard]] std::array<std::uint8_t, 2> status() const;
  [[nodiscard]] Duration byte_time() const;
  [[nodiscard]] bool speeds_agree() const;

  Ft232rSettings settings_;
  std::array<std::uint16_t, 64> eeprom_;
  double baud_ = 9600;
  int latency_ms_ = 16;
  bool rts_ = false, dtr_ = false;
  std::optional<std::uint8_t> event_char_;
  std::uint8_t error_bits_ = 0;  ///< to be told with the next packet
  std::uint8_t damage_ = 0;
  bool ship_now_ = false;
  DeviceTime last_packet_;
  std::deque<Arriving> arriving_;  ///< still on the line
  DeviceTime receiver_free_;
  std::deque<std::uint8_t> received_;
  std::deque<Arriving> leaving_;
  DeviceTime transmitter_free_;
  std::vector<std::uint8_t> sent_;
};

}  // namespace birdseye::hw_sim
