#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/ftdi/ft232r.hpp"

namespace birdseye::hw_sim {

/// One connection to QEMU's usb-redir device, with the chip plugged in: the usbredir protocol, bytes in and bytes out.
/// QEMU takes this for the side with the real USB. No clock, no socket.
class UsbRedir {
 public:
  explicit UsbRedir(Ft232r& chip);

  /// Takes bytes from QEMU. Bytes that are no usbredir, or come from a QEMU that is too old, are an error: the
  /// connection is lost.
  Result<void> receive(std::span<const std::uint8_t> bytes, DeviceTime now);
  /// Gives QEMU what has become due.
  void pump(DeviceTime now);
  /// The bytes to send to QEMU.
  std::vector<std::uint8_t> output();
  /// When pump() next has something to give, unless something comes before; empty while QEMU waits for nothing.
  [[nodiscard]] std::optional<DeviceTime> next_event() const;

  /// Pull and plug the cable, which is plugged in at first. A chip that is plugged in again has lost power in between.
  void unplug();
  void plug(DeviceTime now);
  /// Whether QEMU knows of the chip.
  [[nodiscard]] bool plugged() const { return greeted_ && plugged_; }

 private:
  struct Transfer {
    std::uint64_t id;
    std::uint8_t endpoint;
    std::size_t length;               ///< in: what the host takes at most
    std::vector<std::uint8_t> bytes;  ///< in: so far. out: not yet taken
  };

  void send(std::uint32_t type, std::uint64_t id, std::span<const std::uint8_t> body);
  Result<void> handle(std::uint32_t type, std::uint64_t id, std::span<const std::uint8_t> body, DeviceTime now);
  Result<void> greet(std::span<const std::uint8_t> body, DeviceTime now);
  void announce(DeviceTime now);
  void control(std::uint64_t id, std::span<const std::uint8_t> body, DeviceTime now);
  void bulk(std::uint64_t id, std::span<const std::uint8_t> body);
  void cancel(std::uint64_t id);
  void complete(const Transfer& transfer, std::uint8_t status);
  [[nodiscard]] std::size_t header_bytes() const { return wide_ids_ ? 16 : 12; }

  Ft232r& chip_;
  bool greeted_ = false, plugged_ = true, wide_ids_ = false;
  std::uint8_t configuration_ = 0;
  std::vector<std::uint8_t> in_, out_;
  std::deque<Transfer> reads_, writes_;
};

}  // namespace birdseye::hw_sim
