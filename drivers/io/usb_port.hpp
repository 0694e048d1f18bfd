#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::drivers {

/// The eight bytes that open a control transfer, as they go over the bus. Bit 7 of the first: data comes back.
using SetupPacket = std::array<std::uint8_t, 8>;

/// What a device's descriptors say.
struct UsbIdentity {
  std::string name;  ///< for messages: as the configuration names the device
  std::uint16_t vendor = 0, product = 0, bcd_device = 0;
  std::string product_text, serial;
  bool has_serial = false;  ///< whether there is a serial number string at all
  std::uint16_t max_packet = 64;
};

/// One finished IN transfer; the packet may be empty.
struct UsbInput {
  std::vector<std::uint8_t> bytes;
  DeviceTime arrived;   ///< taken when it completed
  bool failed = false;  ///< the bus lost or refused it
};

/// A claimed USB interface with one bulk endpoint each way: the narrow seam between FtdiPort and libusb. control() and
/// bulk_out() are one thread's, collect() is another's; wake() is anybody's.
class UsbPort {
 public:
  virtual ~UsbPort() = default;

  [[nodiscard]] virtual const UsbIdentity& identity() const = 0;
  /// The data stage's bytes, which are none or as many as setup asks for. Errc::unsupported: the device stalls it.
  virtual Result<std::vector<std::uint8_t>> control(const SetupPacket& setup, Deadline deadline) = 0;
  /// Sends bytes; returns how many the device has taken by the deadline, perhaps none.
  virtual Result<std::size_t> bulk_out(std::span<const std::uint8_t> bytes, Deadline deadline) = 0;
  /// Keeps that many IN transfers of one packet each going from now on.
  virtual Result<void> start_reading(int transfers) = 0;
  /// The oldest finished IN transfer; none by the deadline or after wake(). Errc::disconnected once it is unplugged.
  virtual Result<std::optional<UsbInput>> collect(Deadline deadline) = 0;
  /// Ends a collect() that waits, or the next one.
  virtual void wake() = 0;
};

}  // namespace birdseye::drivers
