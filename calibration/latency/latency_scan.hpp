#pragma once

#include <Eigen/Core>
#include <optional>
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

/// A lag at which the correlation is higher than at those beside it.
struct LagPeak {
  double lag_s = 0, correlation = 0;
  /// With RateMap::rotation: the rotation that brings a's rates to b's.
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
};

struct LagScan {
  std::vector<double> lags_s, correlation;
  LagPeak best;
  bool at_edge = false;
  std::optional<LagPeak> rival;  ///< the next best peak that a dip parts from the best
  std::optional<LagPeak> far;    ///< the best outside of the range, where a dip parts it from the best or it is higher
};

/// How b's rates may follow from a's: by a rotation alone, or by any linear map.
enum class RateMap { rotation, linear };

/// The correlation of b's rates with a's rates under the best map, 0 to 1, at each lag (b later than a) from
/// -most_lag_s to most_lag_s, and in wider steps for far peaks to farthest_s either way, as far as half as many rows
/// still meet. Means are removed and extremes clipped.
LagScan scan_lags(const RateGrid& a, const RateSignal& b, RateMap map, double most_lag_s, double farthest_s);

}  // namespace birdseye::calibration
