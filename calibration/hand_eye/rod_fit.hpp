#pragma once

#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/rod.hpp"

namespace birdseye::calibration {

/// A hand-eye calibration with the rod at a known angle.
struct RodStation {
  double theta_rad = 0;
  Transform<Camera, Sensor> camera_from_sensor;
};

struct RodFit {
  RodScope scope;
  double turn_rms_deg = 0;  ///< of the stations' hand-eye against the model's
  double shift_rms_mm = 0;  ///< the same, of the camera's place in the sensor's frame
};

/// The rod's axis, and the hand-eye at zero, from hand-eye calibrations at two or more angles at least 20 degrees
/// apart.
///
/// The axis's direction is the mean of the turns between all pairs of stations, weighed by their angles; its point the
/// least-squares one of their screws, nearest to the sensor; the hand-eye at zero the mean of the stations brought back
/// there. picture_turn is the one of 1, 0 and -1 that fits best.
/// Errors: Errc::degenerate, where the angles are too few or too near; Errc::bad_value for numbers that are not finite.
Result<RodFit> fit_rod(std::span<const RodStation> stations);

}  // namespace birdseye::calibration
