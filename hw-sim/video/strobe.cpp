#include "hw-sim/video/strobe.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>

#include <cmath>
#include <string_view>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kShortestPulseMs = 1;

void tell(int fd, std::string_view state) {
  (void)!::pwrite(fd, state.data(), state.size(), 0);
}

}  // namespace

Result<Strobe> Strobe::open(const std::filesystem::path& file) {
  UniqueFd fd(::open(file.c_str(), O_WRONLY | O_CLOEXEC));
  if (fd) return Strobe(std::move(fd));
  return Error{Errc::unreadable,
               fmt::format("{}: cannot be written; give --strobe the file pull of a line of gpio-sim", file.string())};
}

void Strobe::start(const CameraTiming& timing, double true_rate_hz, std::int64_t zero_ns) {
  const double high_ns = std::max(timing.exposure_ms, kShortestPulseMs) * 1e6;
  const double first_ns = static_cast<double>(zero_ns) - timing.exposure_ms * 0.5e6;
  thread_ = OwnedThread([fd = fd_.get(), high_ns, first_ns, true_rate_hz](const std::stop_token& stop) {
    ::prctl(PR_SET_TIMERSLACK, 1000UL, 0UL, 0UL, 0UL);
    const auto at = [](double ns) { return DeviceTime{std::llround(ns)}; };
    for (std::int64_t number = 1; !stop.stop_requested(); ++number) {
      const double rise_ns = first_ns + static_cast<double>(number) * 1e9 / true_rate_hz;
      if (at(rise_ns + high_ns) < device_now()) continue;  // it came too late to be seen at all
      sleep_until(at(rise_ns));
      tell(fd, "pull-up");
      sleep_until(at(rise_ns + high_ns));
      tell(fd, "pull-down");
    }
  });
}

}  // namespace birdseye::hw_sim
