#pragma once

#include <memory>
#include <string>

#include "drivers/io/byte_stream.hpp"

namespace birdseye::drivers {

struct LineSettings {
  /// An absolute path (a serial port of the operating system), `usb:0403:6001` or `usb:0403:6001:SERIAL` (an FTDI
  /// adapter without a kernel driver), `tcp:HOST:PORT` (a serial server) or `unix:/path` (a stream socket).
  std::string device;
  int baud = 115200;
  int usb_latency_ms = 1;  ///< how long an FTDI adapter collects bytes before it passes them on, 1 to 255
};

/// Checks settings before anything is opened. The error lists all forms that `device` may have.
Result<void> check_line(const LineSettings& settings);

/// Opens the line, within seconds at most. Errors name the device and the remedy.
Result<std::unique_ptr<ByteStream>> open_line(const LineSettings& settings);

}  // namespace birdseye::drivers
