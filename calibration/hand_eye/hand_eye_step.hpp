#pragma once

#include <optional>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_robust_fit.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"

namespace birdseye::calibration {

/// Whether from some station on, in the order of the input, the sensor sits elsewhere on the scope, or the board
/// elsewhere on what holds it: residuals before and after then differ by more than chance makes of them. The most
/// likely such moment; empty where chance explains all. Stations of a stream are not asked: neighbours err together.
/// working_distance_mm: of the camera from the board, at which the step is told.
std::optional<HandEyeStep> find_step(const HandEyeInput& input, const HandEyeStations& stations,
                                     const ChainFreedom& freedom, const ChainState& state, const RobustFit& robust,
                                     double working_distance_mm);

}  // namespace birdseye::calibration
