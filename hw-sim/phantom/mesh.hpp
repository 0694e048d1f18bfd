#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

/// A triangle surface in the patient frame, mm; normals point out of the body it bounds.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices, normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// The surface at which field crosses 0 (negative inside), by surface nets: one vertex per cell that the surface
/// crosses, at the mean of its edge crossings (S. Gibson, "Constrained elastic surface nets", 1998, without the
/// relaxation, which a smooth field does not need).
Mesh surface_of(const ScalarGrid& field);
/// The surface of a field within a box, closed where the box cuts it off.
Mesh closed_surface(const Field& field, const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm,
                    double spacing_mm);
/// Computes the normals from where the vertices are now.
void compute_normals(Mesh& mesh);
/// The least and the largest coordinates of its vertices.
std::pair<Eigen::Vector3d, Eigen::Vector3d> bounds(const Mesh& mesh);

/// Binary little-endian PLY, the form that every mesh program reads.
Result<void> write_ply(const std::filesystem::path& path, const Mesh& mesh);
Result<Mesh> read_ply(const std::filesystem::path& path);

}  // namespace birdseye::hw_sim
