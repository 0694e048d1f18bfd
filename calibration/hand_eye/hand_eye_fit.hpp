#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/hand_eye/tracked_chain.hpp"

namespace birdseye::calibration {

/// A station with its picture summed up: the board's pose by its corners and the covariance of that.
struct SummedStation {
  TrackedChain chain;
  Transform<Camera, Marker> camera_from_marker;
  Matrix6d view_covariance = Matrix6d::Zero();
};

/// Parameters beyond hand-eye and body_from_marker.
struct ChainFreedom {
  bool time_offset = false;
  bool board_scale = false;
  [[nodiscard]] int parameters() const { return 12 + (time_offset ? 1 : 0) + (board_scale ? 1 : 0); }
  /// Degrees of freedom that the residuals of so many stations have left.
  [[nodiscard]] double of_residuals(std::size_t stations) const {
    return 6 * static_cast<double>(stations) - parameters();
  }
};

struct ChainFit {
  ChainState state;
  Eigen::MatrixXd covariance;  ///< of hand-eye (6), body_from_marker (6), time offset, board scale, as far as free
  std::vector<Vector6d> residuals;
  std::vector<double> cost_trace;
  bool converged = false;
};

/// Degrees of freedom of the t distribution that takes the place of the normal one where stations may be outliers.
inline constexpr double kRobustFreedom = 4;
/// The answer's covariance over the inverse of the normal equations, where those are weighed by that distribution and
/// the residuals are normal: E[w] E[w^2 q / 6] / E[w + w' q / 3]^2, q of chi squared with six degrees of freedom, w(q)
/// the weight (P. Huber, Robust Statistics, 1981, 6.6 and 7.6). The weights are over one for most residuals.
inline constexpr double kRobustCovariance = 1.2297;

/// The normal equations of all stations at a state. Each station's residual is weighed by the inverse of its
/// covariance, which includes that of the view: the board's pose at each station is eliminated (Schur complement).
struct ChainNormal {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  double cost = 0;
};
ChainNormal chain_normal(std::span<const SummedStation> stations, const ChainState& state, const TrackerNoise& noise,
                         const ChainFreedom& freedom, bool robust);

/// Gauss-Newton with Levenberg's damping, from a start. robust: residuals of a t distribution (kRobustFreedom).
ChainFit fit_chain(std::span<const SummedStation> stations, const ChainState& start, const TrackerNoise& noise,
                   const ChainFreedom& freedom, bool robust);

/// Restricted maximum likelihood of the tracker's two variances (H. Patterson and R. Thompson, 1971), the fit being
/// repeated as they change. Variances do not go below kLeastNoise.
TrackerNoise estimate_noise(std::span<const SummedStation> stations, ChainFit& fit, TrackerNoise start,
                            const ChainFreedom& freedom);
inline constexpr TrackerNoise kLeastNoise{0.003, 1e-5};  ///< no tracker is better; exact data would make it zero

/// Few stations hardly tell the two variances apart. So this many degrees of freedom are added to each, as if seen with
/// one noise for both: the position's sigma a tracker's usual multiple of the angle's.
inline constexpr double kNoisePriorFreedom = 6;

/// The noise estimated from medians of the residuals: a start that a few outliers do not move.
TrackerNoise median_noise(std::span<const Vector6d> residuals, const ChainFreedom& freedom);

/// The fit without some of the stations (indices, ascending), by Gauss-Newton from the fit with all of them, and robust
/// if that fit was. Empty if the other stations do not determine it.
struct FitWithout {
  ChainState state;
  Eigen::MatrixXd covariance;  ///< as ChainFit's
};
std::optional<FitWithout> fit_without(std::span<const SummedStation> stations, std::span<const std::size_t> left_out,
                                      const ChainFit& fit, const TrackerNoise& noise, const ChainFreedom& freedom,
                                      bool robust);

/// Of a station's residual under a fit without it: the Mahalanobis distance, squared, against the station's own
/// covariance and the fit's. Infinite where that is no number.
double distance_squared(const SummedStation& station, const FitWithout& without, const TrackerNoise& noise,
                        const ChainFreedom& freedom);

/// Six times the value that an F distribution of (6, freedom) exceeds with the probability exceeded_with: the limit of
/// a squared Mahalanobis distance in six dimensions, if the covariance rests on `freedom` degrees of freedom.
double distance_limit(double exceeded_with, double freedom);
inline constexpr double kOutsideRegion = 0.05;  ///< of a stated 95 % region

}  // namespace birdseye::calibration
