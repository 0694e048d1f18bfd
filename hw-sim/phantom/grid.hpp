#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <vector>

namespace birdseye::hw_sim {

/// A scalar over the patient (LPS, mm). Signed distances are negative inside.
using Field = std::function<double(const Eigen::Vector3d& point_in_patient_mm)>;

/// A regular grid along the patient's axes, x fastest.
struct Grid {
  std::array<int, 3> size{};
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();  ///< centre of the first voxel
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();

  [[nodiscard]] std::size_t voxels() const {
    return static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(size[2]);
  }
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
               static_cast<std::size_t>(size[0]) +
           static_cast<std::size_t>(i);
  }
  [[nodiscard]] Eigen::Vector3d point(int i, int j, int k) const {
    return origin_mm + Eigen::Vector3d(i, j, k).cwiseProduct(spacing_mm);
  }
  [[nodiscard]] Eigen::Vector3d last_mm() const { return point(size[0] - 1, size[1] - 1, size[2] - 1); }
  /// The part of this grid's extent from low to high, at a spacing of its own.
  static Grid around(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm, double spacing_mm);
};

struct ScalarGrid {
  Grid grid;
  std::vector<float> values;

  /// Trilinear; outside the grid, the value at the nearest point of it.
  [[nodiscard]] double at(const Eigen::Vector3d& point_mm) const;
  static ScalarGrid sample(const Field& field, const Grid& grid);
};

/// Gradient of a field by central differences, per mm.
Eigen::Vector3d gradient(const Field& field, const Eigen::Vector3d& point_mm, double step_mm = 0.5);

/// The first point from start along direction (unit) at which the field reaches level, found by steps of step_mm and
/// then bisection; the last point within length_mm where it never does.
Eigen::Vector3d march_to_level(const Field& field, double level, const Eigen::Vector3d& start_mm,
                               const Eigen::Vector3d& direction, double length_mm, double step_mm = 1.0);

}  // namespace birdseye::hw_sim
