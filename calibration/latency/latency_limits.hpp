#pragma once

#include <cstddef>

#include "calibration/latency/latency.hpp"

namespace birdseye::calibration {

// In motion slower than this, the tracker's noise (half a degree looks like 1.7 deg/s over 0.3 s) and the tremor of a
// hand are no longer small beside the motion.
inline constexpr double kLeastTurnDegS = 5, kLeastShiftMmS = 20, kLeastImagePxS = 15;
inline constexpr std::size_t kFewestRows = 20;  ///< of a stream
inline constexpr double kShortestS = 8;         ///< fewer parts than this many seconds give no interval to rely on
inline constexpr double kGoodS = 15;
// Below this, chance reaches as high a correlation at some lag within a second to either side.
inline constexpr double kLeastCorrelation = 0.5, kGoodCorrelation = 0.8;
// A rival lag must explain the streams worse by this many standard errors: in a scan of 200 lags chance reaches 3.
inline constexpr double kRivalSigmas = 4;
// Correlations that differ by less are alike: a smaller dip parts no two peaks, and a peak that is higher by less is no
// better.
inline constexpr double kAlikeCorrelation = 0.02;
// Half of the interval. A scope that is led with care turns by 30 deg/s: 2 ms are 0.06 deg, 0.1 mm at 100 mm.
inline constexpr double kGoodHalfMs = 2, kMostHalfMs = 5;
// A quartz is within 50 ppm of another; beyond, a clock is wrong or samples are lost.
inline constexpr double kMostDriftPpm = 100;
inline constexpr double kMostOutliers = 0.1, kTooManyOutliers = 0.35;
inline constexpr double kLongGapS = 0.5;

inline bool is_moving(const StreamMotion& m) {
  return m.turn_speed_deg_s >= kLeastTurnDegS || m.shift_speed_mm_s >= kLeastShiftMmS ||
         m.image_speed_px_s >= kLeastImagePxS;
}

}  // namespace birdseye::calibration
