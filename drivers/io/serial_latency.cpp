#include "drivers/io/serial_latency.hpp"

#include <fmt/format.h>
#include <linux/serial.h>
#include <sys/ioctl.h>

#include <fstream>

namespace birdseye::drivers {

namespace {

bool set_low_latency(int fd) {
  serial_struct settings{};
  if (::ioctl(fd, TIOCGSERIAL, &settings) != 0) return false;
  settings.flags |= ASYNC_LOW_LATENCY;
  return ::ioctl(fd, TIOCSSERIAL, &settings) == 0;
}

int read_timer(const std::filesystem::path& timer) {
  int ms = 0;
  std::ifstream(timer) >> ms;
  return ms;
}

}  // namespace

std::string lower_latency(int fd, const std::filesystem::path& timer, int timer_ms) {
  std::string text = set_low_latency(fd) ? "low latency mode" : "no low latency mode";
  std::error_code error;
  if (!std::filesystem::exists(timer, error)) return text;
  std::ofstream(timer) << timer_ms << '\n';
  const int actual_ms = read_timer(timer);
  if (actual_ms == timer_ms) return text + fmt::format(", latency timer {} ms", timer_ms);
  return text + fmt::format(", latency timer stays at {} ms (packaging/60-birdseye.rules lets udev set it)", actual_ms);
}

std::filesystem::path latency_timer_of(const std::filesystem::path& device) {
  std::error_code error;
  const std::filesystem::path real = std::filesystem::canonical(device, error);
  return std::filesystem::path("/sys/class/tty") / real.filename() / "device" / "latency_timer";
}

}  // namespace birdseye::drivers
