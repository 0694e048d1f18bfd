#pragma once

#include <optional>
#include <vector>

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/hand_eye/hand_eye_fit.hpp"
#include "calibration/hand_eye/hand_eye_stations.hpp"

namespace birdseye::calibration {

/// The most likely hand-eye over the boards' poses in the pictures, before the corners themselves have their say.
struct RobustFit {
  ChainFit fit;
  TrackerNoise noise;                     ///< stated, or as estimated
  std::vector<SummedStation> summed;      ///< of the stations that are left
  std::vector<PreparedStation> outliers;  ///< the others
};

/// Starts at the best closed form, fits, and takes outliers out of the stations. Tells in the result the starts, the
/// tracker's noise, and of the stations which are outliers, and why. Empty if it does not converge.
std::optional<RobustFit> fit_robustly(const HandEyeInput& in, const ChainFreedom& freedom, HandEyeStations& stations,
                                      HandEyeResult& out);

}  // namespace birdseye::calibration
