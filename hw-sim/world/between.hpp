#pragma once

#include <Eigen/Core>

#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"
#include "hw-sim/world/ease.hpp"

namespace birdseye::hw_sim {

/// From a pose to another as u goes from 0 to 1: along a line, and about one axis.
template <typename To, typename From>
Transform<To, From> between(const Transform<To, From>& a, const Transform<To, From>& b, double u) {
  const Eigen::Vector3d turn = rotation_log(a.rotation().transpose() * b.rotation());
  return Transform<To, From>(Eigen::Matrix3d(a.rotation() * rotation_exp(u * turn)),
                             Eigen::Vector3d(a.translation() + u * (b.translation() - a.translation())));
}

}  // namespace birdseye::hw_sim
