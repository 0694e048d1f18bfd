#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::drivers {

/// A line to an instrument that carries bytes both ways, and perhaps the modem line RTS.
class ByteStream {
 public:
  virtual ~ByteStream() = default;

  /// Waits for at least one byte and returns how many were read; 0 at the deadline. Errc::disconnected when the line is
  /// gone.
  virtual Result<std::size_t> read(std::span<std::uint8_t> into, Deadline deadline) = 0;
  /// Writes all bytes, else Errc::timeout.
  virtual Result<void> write(std::span<const std::uint8_t> bytes, Deadline deadline) = 0;
  virtual void discard_input() = 0;
  /// False where the line has no RTS (a pseudo-terminal, a three-wire cable's adapter).
  virtual bool set_rts(bool asserted) = 0;
  /// For messages: the device as the configuration names it.
  [[nodiscard]] virtual const std::string& name() const = 0;
  /// How often the line has reported damaged bytes (overrun, parity, framing, break) or has lost bytes itself. Damaged
  /// bytes are not delivered: when the count changes between two reads, the reader has lost its place.
  [[nodiscard]] virtual std::uint64_t line_errors() const { return 0; }
  /// When the first byte of the last read came in. Empty where the line knows no more than "before read() returned".
  [[nodiscard]] virtual std::optional<DeviceTime> arrival() const { return std::nullopt; }
  /// One line of what was found and set at opening, for the log.
  [[nodiscard]] virtual std::string describe() const { return name(); }
};

}  // namespace birdseye::drivers
