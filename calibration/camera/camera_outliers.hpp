#pragma once

#include "calibration/camera/camera_views.hpp"

namespace birdseye::calibration {

/// Finds what does not fit the most general lens. Residuals are weighed by Cauchy's function at a scale from their
/// median; views most of whose points do not fit are rejected. A point gets the weight 0, all others 1, if by the
/// scatter of its own view the worst of so many points would lie that far out in only 1 % of cases. On return, lens and
/// poses are those of the fit. Errc::degenerate where fewer than three views remain or no lens is found.
Result<void> leave_out_outliers(CameraModel& camera, SoundViews& views);

}  // namespace birdseye::calibration
