#pragma once

#include <Eigen/Core>

#include "calibration/points/pivot_tip.hpp"

namespace birdseye::calibration::pivot {

/// White's, as much larger as groups by place and by time say that it is too small (two ways: A. Cameron, J. Gelbach
/// and D. Miller, 2011).
Eigen::Matrix3d covariance_of(const Poses& poses, const Indices& used, const TipEquations& linear);

}  // namespace birdseye::calibration::pivot
