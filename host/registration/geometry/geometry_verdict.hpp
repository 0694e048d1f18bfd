#pragma once

#include <vector>

#include "calibration/base/verdict.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// By the error of what a registration is judged: of the first place that it was asked for, which is to be hit; or,
/// where no such place is named, of the organ's inside, whatever other places it was asked for.
enum class JudgedBy { target, inside };

/// Whether an overlay by what register_geometry() found of these views may be believed.
Verdict geometry_verdict(const std::vector<VideoView>& views, const ViewRegistration& found, JudgedBy by);

}  // namespace birdseye::host
