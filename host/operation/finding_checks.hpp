#pragma once

#include <vector>

#include "calibration/base/result.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/patient.hpp"

/// Whether what was read from a file can have been found at all, whoever signed it: the circle about a target is made
/// of these figures, and a negative variance makes it smaller. Errc::bad_value names the figure.
namespace birdseye::host {

Result<void> check_figures(const CalibratedScope& found);
Result<void> check_figures(const RegisteredPatient& found);
Result<void> check_figures(const DeformedOrgan& found);
Result<void> check_figures(const std::vector<NamedPoint>& landmarks);

}  // namespace birdseye::host
