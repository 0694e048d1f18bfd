#include "device/wire/clock_discipline.hpp"

#include <fmt/format.h>
#include <sys/timex.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace birdseye::wire {

ClockDiscipline decode_discipline(const timex& reading, int state) {
  ClockDiscipline discipline;
  const auto status = static_cast<unsigned>(reading.status);
  // TIME_ERROR also comes for a lost pulse per second; STA_UNSYNC is what says that nobody disciplines the clock.
  discipline.synchronised = state != TIME_ERROR && (status & STA_UNSYNC) == 0;
  discipline.max_error = {reading.maxerror * 1000};
  discipline.est_error = {reading.esterror * 1000};
  discipline.tai_known = reading.tai != 0;
  discipline.source = fmt::format("adjtimex: {}{}", discipline.synchronised ? "synchronised" : "not synchronised",
                                  discipline.tai_known ? fmt::format(", TAI-UTC {} s", reading.tai) : "");
  return discipline;
}

Result<ClockDiscipline> read_clock_discipline() {
  timex reading{};
  const int state = ::adjtimex(&reading);
  if (state < 0) {
    return Error{Errc::io, fmt::format("adjtimex: {}; clocks are related by exchanges only", std::strerror(errno))};
  }
  return decode_discipline(reading, state);
}

std::vector<std::string> ptp_devices(const std::string& folder) {
  std::vector<std::string> devices;
  std::error_code failed;
  for (const auto& entry : std::filesystem::directory_iterator(folder, failed)) {
    const std::string name = entry.path().filename();
    const bool numbered = name.size() > 3 && std::all_of(name.begin() + 3, name.end(), [](char c) {
                            return std::isdigit(static_cast<unsigned char>(c)) != 0;
                          });
    if (name.starts_with("ptp") && numbered) devices.push_back(entry.path());
  }
  std::sort(devices.begin(), devices.end());
  return devices;
}

}  // namespace birdseye::wire
