#include "drivers/io/serial_port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <cerrno>
#include <optional>
#include <utility>

#include "drivers/io/monotonic.hpp"

namespace birdseye::drivers {

namespace {

std::optional<speed_t> speed_of(int baud) {
  constexpr std::pair<int, speed_t> kSpeeds[] = {{2400, B2400},   {4800, B4800},   {9600, B9600},    {19200, B19200},
                                                 {38400, B38400}, {57600, B57600}, {115200, B115200}};
  for (const auto& [known, speed] : kSpeeds) {
    if (known == baud) return speed;
  }
  return std::nullopt;
}

Error open_error(const std::string& name, int failed) {
  switch (failed) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return {Errc::not_found,
              fmt::format("{}: no such device; is the tracker plugged in and [tracker] device right?", name), failed};
    case EACCES:
    case EPERM:
      return {Errc::unreadable, fmt::format("{}: no permission; add this user to the group dialout", name), failed};
    case EBUSY:
      return {Errc::in_use, fmt::format("{}: held by another program; stop that one first", name), failed};
    default:
      return {Errc::io, fmt::format("{}: cannot be opened (error {})", name, failed), failed};
  }
}

}  // namespace

bool is_serial_speed(int baud) {
  return speed_of(baud).has_value();
}

Result<std::unique_ptr<SerialPort>> SerialPort::open(const std::filesystem::path& device, int baud) {
  const std::string name = device.string();
  const auto speed = speed_of(baud);
  if (!speed) {
    return Error{Errc::bad_value, fmt::format("{}: baud {} is none of {}", name, baud, kSerialSpeeds)};
  }
  UniqueFd fd(::open(name.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return open_error(name, errno);
  termios settings{};
  if (::tcgetattr(fd.get(), &settings) != 0) {
    return Error{Errc::bad_value, fmt::format("{}: is not a serial port; see [tracker] device", name), errno};
  }
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) return open_error(name, EBUSY);
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB);
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  ::cfsetispeed(&settings, *speed);
  ::cfsetospeed(&settings, *speed);
  if (::tcsetattr(fd.get(), TCSANOW, &settings) != 0) {
    return Error{Errc::io, fmt::format("{}: does not take {} baud, 8N1", name, baud), errno};
  }
  std::unique_ptr<SerialPort> port(new SerialPort(std::move(fd), name));
  port->set_rts(false);
  return port;
}

Result<std::size_t> SerialPort::read(std::span<std::uint8_t> into, DeviceTime deadline) {
  bool hung_up = false;
  for (;;) {
    const ssize_t got = ::read(fd_.get(), into.data(), into.size());
    if (got > 0) return static_cast<std::size_t>(got);
    // A line that has hung up is always ready to be read, and what is read is nothing.
    if (hung_up || (got < 0 && errno != EAGAIN && errno != EINTR)) {
      return Error{Errc::disconnected, fmt::format("{}: the line is gone; was it unplugged?", name_), errno};
    }
    pollfd entry{fd_.get(), POLLIN, 0};
    const int ready = ::poll(&entry, 1, poll_ms(deadline));
    hung_up = ready > 0 && (entry.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0;
    if (ready == 0 && now() >= deadline) return std::size_t{0};
  }
}

Result<void> SerialPort::write(std::span<const std::uint8_t> bytes, DeviceTime deadline) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(fd_.get(), bytes.data(), bytes.size());
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
      continue;
    }
    if (errno != EAGAIN && errno != EINTR) {
      return Error{Errc::disconnected, fmt::format("{}: the line is gone; was it unplugged?", name_), errno};
    }
    pollfd entry{fd_.get(), POLLOUT, 0};
    if (::poll(&entry, 1, poll_ms(deadline)) == 0 && now() >= deadline) {
      return Error{Errc::timeout, fmt::format("{}: does not take commands", name_)};
    }
  }
  return {};
}

void SerialPort::discard_input() {
  ::tcflush(fd_.get(), TCIFLUSH);
}

bool SerialPort::set_rts(bool asserted) {
  const int line = TIOCM_RTS;
  return ::ioctl(fd_.get(), asserted ? TIOCMBIS : TIOCMBIC, &line) == 0;
}

}  // namespace birdseye::drivers
