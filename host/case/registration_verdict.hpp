#pragma once

#include "calibration/base/verdict.hpp"
#include "host/case/registration_case.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Whether an overlay by what was found may be believed. By geometry it goes by the error to be expected of the target,
/// or of the organ's inside where the case has none.
Verdict verdict_of(const RegistrationCase& c, const ViewRegistration& found);

}  // namespace birdseye::host
