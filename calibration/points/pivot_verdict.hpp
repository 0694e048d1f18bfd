#pragma once

#include "calibration/base/verdict.hpp"
#include "calibration/points/pivot.hpp"
#include "calibration/points/spin_axis.hpp"

namespace birdseye::calibration {

/// What a tip is good for: how many poses, how far tilted and to how many sides, outliers, residual, held-out error,
/// sigma, whether the tip slid, and whether its length is a pointer's.
Verdict judge_pivot(const Pivot& pivot);

/// What an axis is good for: how far the pointer was spun, how much it wobbled, outliers, sigma.
Verdict judge_spin_axis(const SpinAxis& axis);

}  // namespace birdseye::calibration
