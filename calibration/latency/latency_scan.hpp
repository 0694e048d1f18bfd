#pragma once

#include <Eigen/Core>
#include <vector>

namespace birdseye::calibration {

/// What one stream does at its own times: a row each.
struct RateSignal {
  std::vector<double> times_s;
  Eigen::MatrixXd rates;
};

/// The other stream, on a uniform grid, so that any lag can be looked up.
struct RateGrid {
  double begin_s = 0, spacing_s = 0.005;
  Eigen::MatrixXd rates;
  std::vector<bool> valid;
};

struct LagScan {
  std::vector<double> lags_s, correlation;
  double best_s = 0, best = 0;
  bool at_edge = false;
  bool has_rival = false;
  double rival_s = 0, rival = 0;  ///< the next best peak that a dip parts from the best
  /// With RateMap::rotation: the rotation that brings a's rates to b's, at the best lag and at the rival.
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity(), rival_turn = Eigen::Matrix3d::Identity();
};

/// How b's rates may follow from a's: by a rotation alone, or by any linear map.
enum class RateMap { rotation, linear };

/// The correlation of b's rates with a's rates under the best map, 0 to 1, at each lag (b later than a) from
/// -most_lag_s to most_lag_s. Means are removed and extremes clipped.
LagScan scan_lags(const RateGrid& a, const RateSignal& b, RateMap map, double most_lag_s);

}  // namespace birdseye::calibration
