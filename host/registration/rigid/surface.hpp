#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// Triangles, in the patient frame, mm.
struct Surface {
  std::vector<Eigen::Vector3f> vertices_mm;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Reads a surface: VTK's legacy polygons (.vtk), PLY, STL or OBJ, by name and by content. Refuses, in one line that
/// names the path, what is of another form, missing, unreadable, damaged, cut short, says that it is in another frame
/// than LPS (SPACE=RAS, as 3D Slicer does), has a corner beyond kFarthestMm, or holds no triangles.
Result<Surface> read_surface(const std::filesystem::path& path);

/// The point of a surface that is nearest to a given point.
struct SurfacePoint {
  Eigen::Vector3d point_mm, normal;  ///< normal: of the triangle, unit length, of either sign
  double distance_mm = 0;
};

/// Finds the nearest points of a surface, exactly, in a tree of its triangles (Embree's).
class SurfaceIndex {
 public:
  explicit SurfaceIndex(const Surface& surface);
  ~SurfaceIndex();
  SurfaceIndex(SurfaceIndex&&) noexcept;
  SurfaceIndex& operator=(SurfaceIndex&&) noexcept;
  [[nodiscard]] SurfacePoint nearest(const Eigen::Vector3d& point_mm) const;
  /// How far it is to the surface along a direction of unit length; none where the ray misses it.
  [[nodiscard]] std::optional<double> first_hit_mm(const Eigen::Vector3d& origin_mm,
                                                   const Eigen::Vector3d& direction) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace birdseye::host
