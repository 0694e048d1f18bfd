#include "calibration/geometry/quaternion_order.hpp"

#include <Eigen/Geometry>

namespace birdseye {

Eigen::Matrix3d reordered(const Eigen::Matrix3d& rotation, QuaternionOrder order) {
  if (order == QuaternionOrder::as_read) return rotation;
  const Eigen::Quaterniond read(rotation);
  return (order == QuaternionOrder::w_first ? Eigen::Quaterniond(read.x(), read.y(), read.z(), read.w())
                                            : Eigen::Quaterniond(read.z(), read.w(), read.x(), read.y()))
      .toRotationMatrix();
}

}  // namespace birdseye
