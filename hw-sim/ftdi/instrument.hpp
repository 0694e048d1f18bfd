#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "calibration/time/clock.hpp"

namespace birdseye::hw_sim {

/// What hangs on the serial line of an adapter. It knows nothing of baud: bytes take their time in the adapter.
class SerialInstrument {
 public:
  virtual ~SerialInstrument() = default;

  virtual void receive(std::span<const std::uint8_t> bytes, DeviceTime now) = 0;
  /// What begins to leave since the last call.
  virtual std::vector<std::uint8_t> send(DeviceTime now) = 0;
  /// The state of its reset input. Holding it keeps the instrument silent; letting it go starts it anew.
  virtual void set_reset(bool held, DeviceTime now) = 0;
  /// When send() may next have something.
  [[nodiscard]] virtual DeviceTime next_send() const = 0;
};

}  // namespace birdseye::hw_sim
