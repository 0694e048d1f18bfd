#pragma once

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_robust_fit.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"

namespace birdseye::calibration {

/// Adds to hand-eye's covariance what the lens's own error makes of it: a lens that is wrong puts the board wrongly in
/// every picture, which the residuals of the stations hardly show. Along each principal direction of the lens's
/// covariance the lens is moved by one sigma, the board's poses are found anew, and hand-eye with them; to first order
/// that is the propagated covariance. Nothing is added where the input holds no covariance or no corners. refined: the
/// answer; robust: what it was refined from.
void add_lens_error(const HandEyeInput& input, const HandEyeStations& stations, const ChainFreedom& freedom,
                    const ChainState& refined, const RobustFit& robust, HandEyeResult& out);

}  // namespace birdseye::calibration
