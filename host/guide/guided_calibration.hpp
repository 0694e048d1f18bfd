#pragma once

#include <optional>
#include <string>

#include "calibration/base/result.hpp"
#include "calibration/base/verdict.hpp"
#include "calibration/camera/camera_calibration.hpp"
#include "calibration/geometry/round_field.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"

namespace birdseye::host {

/// The stations that were taken over a board, and why no more of them were.
struct GuidedStations {
  calibration::HandEyeInput input;
  int width_px = 0, height_px = 0;
  std::optional<calibration::CameraCalibration> lens;  ///< where it was found here
  std::optional<RoundField> round_field;               ///< that their pictures agree on; empty: they show no edge
  std::string lens_fault;                              ///< why none was, in words
  std::string ended;                                   ///< why, in words
};

/// Finds the lens by the stations' views; where that fails, lens_fault says why, and the stations have none.
void find_lens(GuidedStations& stations, const calibration::CameraCalibrationSettings& settings = {});

/// What was found of the stations.
struct GuidedCalibration {
  GuidedStations stations;
  calibration::HandEyeResult hand_eye;
  Verdict verdict;  ///< of hand-eye and, where it was found too, of the lens
};

/// Hand-eye by the stations and their lens, and what to think of both. Without a lens the verdict is fail. Errors: as
/// of calibrate_hand_eye.
Result<GuidedCalibration> calibrate_guided(GuidedStations stations);

}  // namespace birdseye::host
