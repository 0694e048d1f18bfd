#pragma once

#include "calibration/base/verdict.hpp"
#include "host/case/fiducial_registration.hpp"
#include "host/report/html_page.hpp"

namespace birdseye::host {

/// A page on a registration by fiducials: where markers lie and by how much each touch is off, the markers in the CT
/// where there is one, the error to be expected over it, and the touched surface before and after.
HtmlPage fiducials_page(const FiducialInput& input, const FiducialsFound& found, const Verdict& verdict);

}  // namespace birdseye::host
