#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// A pose at which a pointer's tip stood in a divot.
struct PivotPose {
  Transform<Tracker, Sensor> tracker_from_sensor;  ///< or the reference's frame in the tracker's place
  std::size_t divot = 0;                           ///< which one, from 0
  double time_s = 0;                               ///< or a count: orders the poses, to see whether the tip slid
};

/// One tip, and where it stood in each divot.
struct PivotFit {
  Eigen::Vector3d tip_in_sensor_mm = Eigen::Vector3d::Zero();
  std::vector<Eigen::Vector3d> pivots_in_tracker_mm;  ///< by divot
  /// Of the poses that were used: root mean square distance of tip from pivot, and of one coordinate of it, which other
  /// programs state (smaller by the square root of three).
  double rms_mm = 0, component_rms_mm = 0;
};

/// How far the pointer was tilted, by the poses that were used.
struct PivotTilt {
  double widest_deg = 0;  ///< between two directions from sensor to tip in one divot
  /// The direction, in the sensor's frame, that swung least, and its root mean square swing. Along it the tip is known
  /// least: where all tilts turn about one axis, that axis swings by nothing and the tip along it stays unknown.
  Eigen::Vector3d weakest_in_sensor = Eigen::Vector3d::UnitX();
  double weakest_swing_deg = 0;
};

struct Pivot {
  PivotFit algebraic;                       ///< by all poses
  PivotFit robust;                          ///< without outliers: the answer
  std::vector<Eigen::Vector3d> offsets_mm;  ///< of the tip from its pivot, tracker axes, for each pose given
  std::vector<double> residuals_mm;         ///< their lengths
  std::vector<std::size_t> outliers;        ///< poses that were not used, by index, from 0
  /// So that 95 % of tips lie where its squared Mahalanobis distance is up to 7.81, also with few poses. Infinite where
  /// the poses leave a direction open, as tip_sigma_mm.
  Eigen::Matrix3d tip_covariance_mm2 = Eigen::Matrix3d::Zero();
  double tip_sigma_mm = 0;  ///< in the direction in which the tip is known least
  /// Root mean square distance of tip from pivot at poses that the fit had not seen. All poses that lean to one of
  /// eight sides are left out together, for neighbours in time are too alike to test each other. NaN where too few
  /// poses are left.
  double held_out_mm = 0;
  PivotTilt tilt;
  std::size_t distinct_poses = 0;  ///< without those that repeat another to the last digit
  /// How far the tip slid: the median place of the tip in the last third of a divot's poses against that in the first
  /// third, of the divot where this is largest; and what chance makes of it (one sigma).
  double slid_mm = 0, slid_sigma_mm = 0;
  std::size_t slid_divot = 0;
};

/// Linear least squares of R_i t + q_i = p_k for the tip t and the pivots p_k (the algebraic one-step method as Z.
/// Yaniv names it, "Which pivot calibration?", Proc. SPIE 9415, 2015, each p_k replaced by its mean); then random
/// samples (M. Fischler and R. Bolles, 1981; the same ones each time) find the tip whose median residual is least (P.
/// Rousseeuw, 1984), and poses beyond 2.5 robust deviations are outliers. Along a direction that the poses leave open
/// the tip gets the least length, and `tilt` tells the direction. The covariance is that of H. White (1980), by each
/// pose's own residual, because a tracker's errors of angle move a tip across the shaft more than along it. The order
/// of the poses does not matter. Refuses fewer than four poses (Errc::degenerate) and numbers that are not finite.
Result<Pivot> solve_pivot(std::span<const PivotPose> poses);

}  // namespace birdseye::calibration
