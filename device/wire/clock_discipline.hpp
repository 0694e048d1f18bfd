#pragma once

#include "calibration/base/result.hpp"
#include "calibration/time/discipline.hpp"
#include "drivers/system/clock.hpp"

struct timex;

namespace birdseye::wire {

/// What adjtimex(2) filled in, and what it returned.
ClockDiscipline decode_discipline(const timex& reading, int state);

/// Asks the kernel. Changes nothing, and needs no privilege.
Result<ClockDiscipline> read_clock_discipline();

}  // namespace birdseye::wire
