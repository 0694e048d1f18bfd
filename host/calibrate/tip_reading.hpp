#pragma once

#include "host/calibrate/tip_calibration.hpp"

namespace birdseye::host {

/// Whether the file seems to have been read otherwise than it was written: another order of the quaternion, rotations
/// or axes that do not go with the positions, inverted poses, another unit of length.
void judge_reading(const TipInput& input, const calibration::Pivot& pivot, Verdict& verdict);

}  // namespace birdseye::host
