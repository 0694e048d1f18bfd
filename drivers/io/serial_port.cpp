#include "drivers/io/serial_port.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <utility>

#include "drivers/io/serial_latency.hpp"
#include "drivers/system/wait.hpp"

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
              fmt::format("{}: no such device; is the tracker plugged in and [tracker] device right?", name)};
    case EACCES:
    case EPERM:
      return {Errc::unreadable, fmt::format("{}: no permission; add this user to the group dialout", name)};
    case EBUSY:
      return {Errc::in_use, fmt::format("{}: held by another program; stop that one first", name)};
    default:
      return {Errc::io, fmt::format("{}: cannot be opened (error {})", name, failed)};
  }
}

/// A pseudo-terminal's exclusiveness would outlive a driver that was killed, for as long as its other end is open.
bool is_pseudo_terminal(int fd) {
  struct stat status {};
  constexpr unsigned kFirst = 136, kLast = 143;
  return ::fstat(fd, &status) == 0 && major(status.st_rdev) >= kFirst && major(status.st_rdev) <= kLast;
}

/// Raw, 8N1, no flow control; damaged bytes marked.
termios raw_settings(termios settings, speed_t speed) {
  ::cfmakeraw(&settings);
  settings.c_iflag |= INPCK | PARMRK;
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB | PARENB);
  settings.c_cc[VMIN] = 0;
  settings.c_cc[VTIME] = 0;
  ::cfsetispeed(&settings, speed);
  ::cfsetospeed(&settings, speed);
  return settings;
}

}  // namespace

bool is_serial_speed(int baud) {
  return speed_of(baud).has_value();
}

Result<std::unique_ptr<SerialPort>> SerialPort::open(const std::filesystem::path& device, int baud,
                                                     int usb_latency_ms) {
  const std::string name = device.string();
  const auto speed = speed_of(baud);
  if (!speed) {
    return Error{Errc::bad_value, fmt::format("{}: baud {} is none of {}", name, baud, kSerialSpeeds)};
  }
  UniqueFd fd(::open(name.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  if (!fd) return open_error(name, errno);
  termios settings{};
  if (::tcgetattr(fd.get(), &settings) != 0) {
    return Error{Errc::bad_value, fmt::format("{}: is not a serial port; see [tracker] device", name)};
  }
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) return open_error(name, EBUSY);
  // Against programs that do not lock, too.
  if (!is_pseudo_terminal(fd.get())) ::ioctl(fd.get(), TIOCEXCL);
  settings = raw_settings(settings, *speed);
  if (::tcsetattr(fd.get(), TCSANOW, &settings) != 0 || ::tcgetattr(fd.get(), &settings) != 0) {
    return Error{Errc::io, fmt::format("{}: does not take {} baud, 8N1", name, baud)};
  }
  std::unique_ptr<SerialPort> port(new SerialPort(std::move(fd), name));
  port->set_rts(false);
  port->marked_ = (settings.c_iflag & PARMRK) != 0;
  port->overruns_ = port->overruns();
  port->description_ =
      fmt::format("{}: {} baud, {}, {}", name, baud, port->marked_ ? "damaged bytes marked" : "damage goes unmarked",
                  lower_latency(port->fd_.get(), latency_timer_of(device), usb_latency_ms));
  return port;
}

Error SerialPort::gone() const {
  return {Errc::disconnected, fmt::format("{}: the line is gone; was it unplugged?", name_)};
}

std::optional<std::uint64_t> SerialPort::overruns() const {
  serial_icounter_struct counts{};
  if (::ioctl(fd_.get(), TIOCGICOUNT, &counts) != 0) return std::nullopt;
  return static_cast<std::uint64_t>(counts.overrun) + static_cast<std::uint64_t>(counts.buf_overrun);
}

/// A lost byte leaves no mark in the stream, only a count. Where it was nobody knows, so all that waits is dropped.
/// The count is raised before the bytes behind the hole are there to be read; it is read before all that waits is
/// dropped, so that a loss in between shows the next time.
bool SerialPort::lost_bytes() {
  if (!overruns_) return false;
  const auto seen = overruns();
  if (!seen || *seen == *overruns_) return false;
  line_errors_ += *seen - *overruns_;
  overruns_ = seen;
  discard_input();
  return true;
}

std::size_t SerialPort::decode(std::span<std::uint8_t> into) {
  while (raw_begin_ < raw_end_) {
    const std::span<const std::uint8_t> raw(raw_.data() + raw_begin_, raw_end_ - raw_begin_);
    if (!marked_) {
      const std::size_t count = std::min(raw.size(), into.size());
      std::copy_n(raw.begin(), count, into.begin());
      raw_begin_ += count;
      return count;
    }
    const SerialMarks::Step step = marks_.decode(raw, into);
    raw_begin_ += step.used;
    if (step.made > 0) {
      damage_next_ = step.damaged;  // to be told with the bytes behind it, not with those before
      return step.made;
    }
    if (step.damaged) ++line_errors_;
  }
  return 0;
}

Result<std::size_t> SerialPort::read(std::span<std::uint8_t> into, Deadline deadline) {
  if (into.empty()) return std::size_t{0};
  if (std::exchange(damage_next_, false)) ++line_errors_;
  if (const std::size_t made = decode(into); made > 0) return made;
  bool hung_up = false;
  for (;;) {
    const ssize_t got = ::read(fd_.get(), raw_.data(), raw_.size());
    if (got > 0) {
      raw_begin_ = 0;
      raw_end_ = static_cast<std::size_t>(got);
      const std::size_t made = lost_bytes() ? 0 : decode(into);
      // Nothing but damage may go on for ever.
      if (made > 0 || deadline.passed()) return made;
      continue;
    }
    // A line that has hung up is always ready to be read, and what is read is nothing.
    if (hung_up || (got < 0 && errno != EAGAIN && errno != EINTR)) return gone();
    const short ready = wait_ready(fd_.get(), POLLIN, deadline);
    if (ready == 0) return std::size_t{0};
    hung_up = (ready & (POLLHUP | POLLERR | POLLNVAL)) != 0;
  }
}

Result<void> SerialPort::write(std::span<const std::uint8_t> bytes, Deadline deadline) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(fd_.get(), bytes.data(), bytes.size());
    if (put > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(put));
      continue;
    }
    if (put < 0 && errno != EAGAIN && errno != EINTR) return gone();
    if (wait_ready(fd_.get(), POLLOUT, deadline) == 0) {
      return Error{Errc::timeout, fmt::format("{}: does not take commands", name_)};
    }
  }
  return {};
}

void SerialPort::discard_input() {
  ::tcflush(fd_.get(), TCIFLUSH);
  raw_begin_ = raw_end_ = 0;
  marks_ = {};
  if (std::exchange(damage_next_, false)) ++line_errors_;
}

bool SerialPort::set_rts(bool asserted) {
  const int line = TIOCM_RTS;
  return ::ioctl(fd_.get(), asserted ? TIOCMBIS : TIOCMBIC, &line) == 0;
}

}  // namespace birdseye::drivers
