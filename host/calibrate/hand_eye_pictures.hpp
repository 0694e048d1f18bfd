#pragma once

#include "host/calibrate/hand_eye_files.hpp"

namespace birdseye::host {

/// Fills in one station for each picture, in the order of the names (numbers in them by value), without a view where
/// the board was not found; the lens, read or calibrated from the same pictures; and the board's symmetry.
Result<void> read_hand_eye_pictures(const HandEyeFiles& files, HandEyeRecording& out);

}  // namespace birdseye::host
