#pragma once

#include <optional>

#include "calibration/hand_eye/hand_eye_observability.hpp"

namespace birdseye::calibration {

/// Whether the poses fit far better the other way round, mirrored, with w in another place of their quaternions, or
/// with their positions' axes exchanged or of other signs, than as they are given; then what they seem to be, and the
/// remedy.
std::optional<Finding> find_wrong_frames(const StationsInOrder& in);

}  // namespace birdseye::calibration
