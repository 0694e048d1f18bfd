#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// The direction of a pointer's shaft, from poses while the pointer was spun about the shaft.
struct SpinAxis {
  Eigen::Vector3d axis_in_sensor = Eigen::Vector3d::UnitZ();  ///< of length one
  double sigma_deg = 0;   ///< of the axis, in the direction in which it is known least
  double wobble_deg = 0;  ///< root mean square angle of the axis from where it stood, of the poses that were used
  double turned_deg = 0;  ///< of a full turn, without the widest gap between two poses
  std::vector<double> residuals_deg;  ///< of each pose given
  std::vector<std::size_t> outliers;  ///< poses that were not used, by index, from 0
};

/// The direction a of the sensor that moves least, min sum |R_i a - b|^2: the eigenvector of the least eigenvalue of
/// sum (R_i - mean)^T (R_i - mean). Poses beyond 2.5 robust deviations are outliers. Its sense is towards `towards`
/// (the tip; in the sensor's frame).
/// Refuses fewer than four poses (Errc::degenerate) and numbers that are not finite.
Result<SpinAxis> solve_spin_axis(std::span<const Transform<Tracker, Sensor>> tracker_from_sensor,
                                 const Eigen::Vector3d& towards);

}  // namespace birdseye::calibration
