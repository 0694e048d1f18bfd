#pragma once

#include <optional>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "host/calibrate/hand_eye_files.hpp"
#include "host/calibrate/hand_eye_rod.hpp"

namespace birdseye::host {

/// What is found from a recording, and what to think of it.
struct HandEyeFound {
  calibration::HandEyeResult result;
  std::optional<RodCalibration> rod;
  Verdict verdict;
};

/// Hand-eye from a recording, and the verdict with that on its lens. angles: of an oblique scope's rod, else empty; the
/// recording then keeps the stations of the reference angle, of which the result is. by_eye_poses: the recording holds
/// poses of the camera in place of pictures. Too little to solve anything is a verdict, no error.
Result<HandEyeFound> solve_hand_eye(HandEyeRecording& recording, const RodAngles& angles, bool by_eye_poses);

}  // namespace birdseye::host
