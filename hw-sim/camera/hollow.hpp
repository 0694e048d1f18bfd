#pragma once

#include <Eigen/Core>
#include <vector>

#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// Tissue that was cut out of the organ's face: a round hollow, its floor as deep everywhere under the face as it was.
struct Hollow {
  Eigen::Vector3d axis_mm = Eigen::Vector3d::Zero();   ///< a point of its axis
  Eigen::Vector3d outward = Eigen::Vector3d::UnitZ();  ///< the axis, out of the organ, unit
  double width_mm = 0, depth_mm = 0;
  bool operator==(const Hollow&) const = default;
};

/// Sinks the face within the hollow; its rim is steep. rest_mm: of each vertex; the tissue that is laid bare looks as
/// the tissue at that depth does.
void hollow_out(const Hollow& hollow, Mesh& organ, std::vector<Eigen::Vector3f>& rest_mm);

}  // namespace birdseye::hw_sim
