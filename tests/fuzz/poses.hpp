#pragma once

#include <Eigen/LU>

#include "calibration/geometry/transform.hpp"

namespace birdseye::testing {

/// What an overlay may be drawn by: finite, and a rotation, as far as the most careless file that is read has one.
inline bool is_rigid(const Eigen::Matrix4d& matrix) {
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  return matrix.allFinite() && (r * r.transpose()).isIdentity(1e-2) && r.determinant() > 0;
}

template <typename To, typename From>
bool is_pose(const Transform<To, From>& pose) {
  return is_rigid(pose.matrix());
}

}  // namespace birdseye::testing
