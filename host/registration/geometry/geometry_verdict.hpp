#pragma once

#include <vector>

#include "calibration/base/verdict.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// Whether an overlay by what register_geometry() found of these views may be believed: by the error to be expected of
/// the first target that it was asked for, or of the organ's inside where it was asked for none.
Verdict geometry_verdict(const std::vector<VideoView>& views, const ViewRegistration& found);

}  // namespace birdseye::host
