#pragma once

#include <Eigen/Geometry>

#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::hw_sim {

/// A camera at eye that looks at target. The picture's downward direction is as near as possible to `down`, then turned
/// by roll about the camera's axis.
template <typename Frame>
Transform<Frame, Camera> look_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target, const Eigen::Vector3d& down,
                                 double roll_rad) {
  const Eigen::Vector3d z = (target - eye).normalized();
  const Eigen::Vector3d x = down.cross(z).normalized();
  Eigen::Matrix3d rotation;
  rotation << x, z.cross(x), z;
  return Transform<Frame, Camera>(Eigen::Matrix3d(rotation * rotation_exp(Eigen::Vector3d(0, 0, roll_rad))), eye);
}

}  // namespace birdseye::hw_sim
