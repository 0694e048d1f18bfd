#include "drivers/io/open_line.hpp"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <utility>

#include "drivers/io/ftdi_port.hpp"
#include "drivers/io/libusb_port.hpp"
#include "drivers/io/serial_port.hpp"
#include "drivers/io/socket_line.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::drivers {

namespace {

constexpr Duration kConnect = Duration::from_ms(1500);

struct TcpAddress {
  std::string host;
  std::uint16_t port = 0;
};

/// HOST:PORT or [HOST]:PORT, the latter for addresses that have colons themselves.
std::optional<TcpAddress> parse_tcp(std::string_view text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return std::nullopt;
  TcpAddress address;
  std::string_view host = text.substr(0, colon), port = text.substr(colon + 1);
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (bracketed) host = host.substr(1, host.size() - 2);
  const auto [end, failed] = std::from_chars(port.data(), port.data() + port.size(), address.port);
  if (failed != std::errc() || end != port.data() + port.size() || address.port == 0) return std::nullopt;
  if (host.empty() || (!bracketed && host.find_first_of(":[]") != std::string_view::npos)) return std::nullopt;
  address.host = host;
  return address;
}

Error no_device(const std::string& device) {
  return {
      Errc::bad_value,
      fmt::format("{}: is no line; there are /dev/... (a serial port), usb:VENDOR:PRODUCT[:SERIAL] (an FTDI adapter "
                  "without a kernel driver, as usb:0403:6001), tcp:HOST:PORT (a serial server) and unix:/path (a "
                  "stream socket)",
                  device.empty() ? "\"\"" : device)};
}

Result<std::unique_ptr<ByteStream>> upcast(auto opened) {
  if (!opened) return opened.error();
  return std::unique_ptr<ByteStream>(*std::move(opened));
}

}  // namespace

Result<void> check_line(const LineSettings& settings) {
  const std::string& device = settings.device;
  if (device.starts_with("usb:")) {
    if (auto address = parse_usb_address(device); !address) return address.error();
  } else if (device.starts_with("tcp:")) {
    if (!parse_tcp(std::string_view(device).substr(4))) {
      return Error{Errc::bad_value,
                   fmt::format("{}: is no TCP address; write tcp:HOST:PORT, the port from 1 to 65535, an "
                               "IPv6 address in brackets",
                               device)};
    }
  } else if (!device.starts_with("unix:/") && !device.starts_with('/')) {
    return no_device(device);
  }
  if (!is_serial_speed(settings.baud)) {
    return Error{Errc::bad_value, fmt::format("{}: baud {} is none of {}", device, settings.baud, kSerialSpeeds)};
  }
  if (settings.usb_latency_ms < 1 || settings.usb_latency_ms > 255) {
    return Error{Errc::bad_value,
                 fmt::format("{}: a latency timer of {} ms; adapters take 1 to 255, and 1 or 2 are best", device,
                             settings.usb_latency_ms)};
  }
  return {};
}

Result<std::unique_ptr<ByteStream>> open_line(const LineSettings& settings) {
  if (auto checked = check_line(settings); !checked) return checked.error();
  const std::string& device = settings.device;
  if (device.starts_with("usb:")) {
    auto usb = open_libusb_port(*parse_usb_address(device));
    if (!usb) return usb.error();
    FtdiSettings ftdi;
    ftdi.baud = settings.baud;
    ftdi.latency_ms = settings.usb_latency_ms;
    return upcast(FtdiPort::open(*std::move(usb), ftdi));
  }
  if (device.starts_with("tcp:")) {
    const TcpAddress address = *parse_tcp(std::string_view(device).substr(4));
    return upcast(SocketLine::connect_tcp(address.host, address.port, device_now() + kConnect));
  }
  if (device.starts_with("unix:")) return upcast(SocketLine::connect_unix(device.substr(5), device_now() + kConnect));
  return upcast(SerialPort::open(device, settings.baud, settings.usb_latency_ms));
}

}  // namespace birdseye::drivers
