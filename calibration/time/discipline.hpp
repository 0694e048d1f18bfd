#pragma once

#include <optional>
#include <string>

#include "calibration/time/clock.hpp"

namespace birdseye {

/// What a machine's kernel says of the discipline (PTP, NTP) of its clock.
struct ClockDiscipline {
  bool synchronised = false;
  Duration max_error;      ///< the kernel's bound on the clock's error
  Duration est_error;      ///< what the disciplining program takes it to be
  bool tai_known = false;  ///< PTP programs tell the kernel how far TAI is from UTC, which NTP ones may not
  std::string source;      ///< for messages: where the reading is from
};

struct ClockChoice {
  enum class Way { exchange, common_clock };
  Way way = Way::exchange;
  Duration sigma;
};

/// How far apart two disciplined clocks are (one sigma), by what both kernels say: for each side the estimated error,
/// but no less than a tenth of the maximum error, or maximum / sqrt 3 without an estimate; both sides in quadrature.
/// Empty unless both are synchronised.
std::optional<Duration> common_clock_sigma(const ClockDiscipline& device, const ClockDiscipline& host);

/// By which way host and device time are to be related: the one with the smaller honest sigma. exchange_sigma: empty
/// while there was no exchange.
std::optional<ClockChoice> choose_clock(const std::optional<Duration>& exchange_sigma, const ClockDiscipline& device,
                                        const ClockDiscipline& host);

}  // namespace birdseye
