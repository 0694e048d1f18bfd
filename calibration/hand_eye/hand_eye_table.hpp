#pragma once

#include "calibration/hand_eye/hand_eye_blocks.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_robust_fit.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"

namespace birdseye::calibration {

/// Tells in the result how each station fits, outliers too, and the held-out errors over all that are used: each
/// station by the fit without the block that it is in. refined: the answer; robust: what it was refined from.
void fill_station_table(const HandEyeStations& stations, const ChainFreedom& freedom, const ChainState& refined,
                        const RobustFit& robust, const HandEyeBlocks& blocks, HandEyeResult& out);

}  // namespace birdseye::calibration
