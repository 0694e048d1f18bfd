#pragma once

#include "calibration/geometry/camera_model.hpp"

namespace birdseye {

/// The tangent of the angle off the axis at which the lens model folds first: up to there its Jacobian keeps its sign
/// in every direction, so that no two rays meet in one pixel. Infinite where it does not fold within kWidestTangent.
double fold_radius(const CameraModel& camera);

/// The tangent of the widest angle off the axis at which a picture is of use: 84 degrees.
inline constexpr double kWidestTangent = 10;

/// As project does, but empty for points that the lens does not see: beyond a fold the polynomial leads back into the
/// picture, where other rays belong. fold: fold_radius of the camera, which takes a while to find.
std::optional<Eigen::Vector2d> project_seen(const CameraModel& camera, const Eigen::Vector3d& point_in_camera_mm,
                                            double fold);

}  // namespace birdseye
