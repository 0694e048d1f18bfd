#include "hw-sim/camera/hollow.hpp"

#include <algorithm>

namespace birdseye::hw_sim {

void hollow_out(const Hollow& hollow, Mesh& organ, std::vector<Eigen::Vector3f>& rest_mm) {
  constexpr double kRimMm = 3;
  for (std::size_t i = 0; i < organ.vertices.size(); ++i) {
    const Eigen::Vector3d from_axis = organ.vertices[i].cast<double>() - hollow.axis_mm;
    const double above = from_axis.dot(hollow.outward);
    const double aside = (from_axis - above * hollow.outward).norm();
    const double share = std::clamp((0.5 * hollow.width_mm - aside) / kRimMm, 0.0, 1.0);
    if (share <= 0 || organ.normals[i].cast<double>().dot(hollow.outward) <= 0) continue;
    const Eigen::Vector3f sunk = (-share * hollow.depth_mm * hollow.outward).cast<float>();
    organ.vertices[i] += sunk;
    rest_mm[i] += sunk;
  }
  compute_normals(organ);
}

}  // namespace birdseye::hw_sim
