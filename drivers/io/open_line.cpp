#include "drivers/io/open_line.hpp"

#include <fmt/format.h>

#include "drivers/io/serial_port.hpp"

namespace birdseye::drivers {

Result<void> check_line(const LineSettings& settings) {
  if (!settings.device.starts_with('/')) {
    return Error{Errc::bad_value, fmt::format("{}: is no absolute path of a serial port", settings.device)};
  }
  if (!is_serial_speed(settings.baud)) {
    return Error{Errc::bad_value,
                 fmt::format("{}: baud {} is none of {}", settings.device, settings.baud, kSerialSpeeds)};
  }
  return {};
}

Result<std::unique_ptr<ByteStream>> open_line(const LineSettings& settings) {
  if (auto checked = check_line(settings); !checked) return checked.error();
  auto port = SerialPort::open(settings.device, settings.baud);
  if (!port) return port.error();
  return std::unique_ptr<ByteStream>(*std::move(port));
}

}  // namespace birdseye::drivers
