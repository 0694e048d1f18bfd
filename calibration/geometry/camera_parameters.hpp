#pragma once

#include <Eigen/Core>

#include "calibration/geometry/camera_model.hpp"

namespace birdseye {

/// The nine parameters of a lens, in CameraModel's order: fx fy cx cy in px, k1 k2 p1 p2 k3.
using CameraVector = Eigen::Matrix<double, CameraModel::kParameters, 1>;
/// Their covariance, or what is summed up to one.
using CameraMatrix = Eigen::Matrix<double, CameraModel::kParameters, CameraModel::kParameters>;

CameraVector parameters_of(const CameraModel& camera);
/// parameters: nine of them.
void set_parameters(CameraModel& camera, const double* parameters);

}  // namespace birdseye
