#include "calibration/geometry/rigid_matrix.hpp"

#include <Eigen/LU>

namespace birdseye {

bool is_rigid(const Eigen::Matrix4d& matrix, double tolerance) {
  const Eigen::Matrix3d r = matrix.topLeftCorner<3, 3>();
  return matrix.allFinite() && (r * r.transpose()).isIdentity(tolerance) && r.determinant() > 0 &&
         matrix.topRightCorner<3, 1>().cwiseAbs().maxCoeff() <= kFarthestMm;
}

}  // namespace birdseye
