#include "calibration/time/discipline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace birdseye {
namespace {

/// One side's sigma, s. The bound adds up all that can go wrong and is far too wide for a deviation; an estimate is
/// believed, but not below a tenth of the bound. An estimate of nothing at all is one that nobody filled in: then the
/// error is anywhere within the bound.
double side_sigma_s(const ClockDiscipline& side) {
  const double bound_s = side.max_error.seconds(), estimate_s = side.est_error.seconds();
  if (estimate_s <= 0) return bound_s / std::sqrt(3.0);
  return std::max(estimate_s, bound_s / 10);
}

}  // namespace

std::optional<Duration> common_clock_sigma(const ClockDiscipline& device, const ClockDiscipline& host) {
  if (!device.synchronised || !host.synchronised) return std::nullopt;
  return Duration::from_seconds(std::hypot(side_sigma_s(device), side_sigma_s(host)));
}

std::optional<ClockChoice> choose_clock(const std::optional<Duration>& exchange_sigma, const ClockDiscipline& device,
                                        const ClockDiscipline& host) {
  const auto common = common_clock_sigma(device, host);
  if (!common && !exchange_sigma) return std::nullopt;
  const auto ms = [](Duration span) { return span.seconds() * 1e3; };
  if (common && (!exchange_sigma || *common < *exchange_sigma)) {
    return ClockChoice{
        ClockChoice::Way::common_clock, *common,
        fmt::format("both clocks are disciplined ({}; {}), to {:.3f} ms", device.source, host.source, ms(*common))};
  }
  const std::string other =
      common ? fmt::format("the disciplined clocks only agree to {:.3f} ms", ms(*common))
             : fmt::format("the {}'s clock is not synchronised", device.synchronised ? "host" : "device");
  return ClockChoice{ClockChoice::Way::exchange, *exchange_sigma,
                     fmt::format("exchanges over the wire tell {:.3f} ms; {}", ms(*exchange_sigma), other)};
}

}  // namespace birdseye
