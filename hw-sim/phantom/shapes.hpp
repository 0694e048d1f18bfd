#pragma once

#include <Eigen/Core>

namespace birdseye::hw_sim {

/// Signed distances, mm, negative inside. The ellipsoid's is a first-order estimate, exact on its surface.
double ellipsoid_mm(const Eigen::Vector3d& point, const Eigen::Vector3d& centre, const Eigen::Vector3d& radii);
/// A rod of round section whose radius goes from radius_a at a to radius_b at b.
double tapered_rod_mm(const Eigen::Vector3d& point, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius_a,
                      double radius_b);
/// The union of two shapes with the crease between them rounded over blend_mm.
double smooth_union(double a, double b, double blend_mm);
/// How much of a voxel a shape fills, from its signed distance: 0 to 1 over width_mm.
double occupancy(double distance_mm, double width_mm);

}  // namespace birdseye::hw_sim
