#pragma once

#include "calibration/camera/camera_views.hpp"

namespace birdseye::calibration {

/// Finds what does not fit the most general lens: weighs residuals by Cauchy's function at a scale from their median,
/// rejects views most of whose points do not fit, and leaves out (weight 0, all others 1) points further out than
/// chance would put one of them with 1 %, judged by the scatter of their own view. Lens and poses are left at the fit.
/// Errc::degenerate where fewer than three views remain or no lens is found.
Result<void> leave_out_outliers(CameraModel& camera, SoundViews& views);

}  // namespace birdseye::calibration
