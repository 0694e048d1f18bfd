#pragma once

#include <Eigen/Core>

namespace birdseye {

/// How a quaternion's four numbers may stand in a file, against how they were read.
enum class QuaternionOrder {
  as_read,
  w_first,  ///< they were read with w last
  w_last,   ///< they were read with w first
};

/// The rotation that was meant, of one that was read from a quaternion.
Eigen::Matrix3d reordered(const Eigen::Matrix3d& rotation, QuaternionOrder order);

/// The inverse of a pose under the pose's own name: what a file holds whose poses were inverted as they were read, and
/// back. Frames do not cancel here.
template <typename Pose>
Pose turned_round(const Pose& pose) {
  const auto back = pose.inverse();
  return {back.rotation(), back.translation()};
}

}  // namespace birdseye
