#include "calibration/time/discipline.hpp"

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
  if (common && (!exchange_sigma || *common < *exchange_sigma))
    return ClockChoice{ClockChoice::Way::common_clock, *common};
  return ClockChoice{ClockChoice::Way::exchange, *exchange_sigma};
}

}  // namespace birdseye
