#include "hw-sim/phantom/shapes.hpp"

#include <algorithm>
#include <cmath>

namespace birdseye::hw_sim {

double ellipsoid_mm(const Eigen::Vector3d& point, const Eigen::Vector3d& centre, const Eigen::Vector3d& radii) {
  const Eigen::Vector3d scaled = (point - centre).cwiseQuotient(radii);
  const double norm = scaled.norm();
  const double slope = scaled.cwiseQuotient(radii).norm();
  return slope > 1e-12 ? norm * (norm - 1) / slope : -radii.minCoeff();
}

double tapered_rod_mm(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius_a,
                      double radius_b) {
  const Eigen::Vector3d axis = b - a;
  const double t = std::clamp((point - a).dot(axis) / std::max(1e-12, axis.squaredNorm()), 0.0, 1.0);
  return (point - a - t * axis).norm() - (radius_a + t * (radius_b - radius_a));
}

double smooth_union(double a, double b, double blend_mm) {
  const double h = std::clamp(0.5 + 0.5 * (b - a) / blend_mm, 0.0, 1.0);
  return b + (a - b) * h - blend_mm * h * (1 - h);
}

double occupancy(double distance_mm, double width_mm) {
  return std::clamp(0.5 - distance_mm / width_mm, 0.0, 1.0);
}

}  // namespace birdseye::hw_sim
