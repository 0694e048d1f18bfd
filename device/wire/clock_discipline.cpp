#include "device/wire/clock_discipline.hpp"

#include <fmt/format.h>
#include <sys/timex.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "drivers/system/time_keeper.hpp"

namespace birdseye::wire {

ClockDiscipline decode_discipline(const timex& reading, int state) {
  ClockDiscipline discipline;
  const auto status = static_cast<unsigned>(reading.status);
  // The kernel keeps the errors as a program told it: one below zero is none, and such a clock is as good as
  // undisciplined.
  const bool errors_known = reading.maxerror >= 0 && reading.esterror >= 0;
  // TIME_ERROR also comes for a lost pulse per second; STA_UNSYNC is what says that nobody disciplines the clock.
  discipline.synchronised = errors_known && state != TIME_ERROR && (status & STA_UNSYNC) == 0;
  discipline.max_error = {std::max(reading.maxerror, 0L) * 1000};  // hosts refuse one below zero
  discipline.est_error = {std::max(reading.esterror, 0L) * 1000};
  discipline.tai_known = reading.tai != 0;
  discipline.source = fmt::format("adjtimex: {}{}", discipline.synchronised ? "synchronised" : "not synchronised",
                                  discipline.tai_known ? fmt::format(", TAI-UTC {} s", reading.tai) : "");
  return discipline;
}

Result<ClockDiscipline> read_clock_discipline() {
  if (TimeKeeper::present() != nullptr) return Error{Errc::unsupported, "a simulator keeps the time"};
  timex reading{};
  const int state = ::adjtimex(&reading);
  if (state < 0) {
    return Error{Errc::io, fmt::format("adjtimex: {}; clocks are related by exchanges only", std::strerror(errno))};
  }
  return decode_discipline(reading, state);
}

}  // namespace birdseye::wire
