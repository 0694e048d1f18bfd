#include "hw-sim/phantom/grid.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace birdseye::hw_sim {

Grid Grid::around(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm, double spacing_mm) {
  Grid grid;
  grid.origin_mm = low_mm;
  grid.spacing_mm = Eigen::Vector3d::Constant(spacing_mm);
  for (int axis = 0; axis < 3; ++axis) {
    grid.size[static_cast<std::size_t>(axis)] =
        static_cast<int>(std::ceil((high_mm[axis] - low_mm[axis]) / spacing_mm)) + 1;
  }
  return grid;
}

double ScalarGrid::at(const Eigen::Vector3d& point_mm) const {
  const Eigen::Vector3d scaled = (point_mm - grid.origin_mm).cwiseQuotient(grid.spacing_mm);
  std::array<int, 3> base{};
  std::array<double, 3> part{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double v = std::clamp(scaled[static_cast<Eigen::Index>(axis)], 0.0, grid.size[axis] - 1.0);
    base[axis] = std::min(static_cast<int>(v), std::max(0, grid.size[axis] - 2));
    part[axis] = v - base[axis];
  }
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int i = corner & 1;
    const int j = (corner >> 1) & 1;
    const int k = corner >> 2;
    const double weight =
        (i != 0 ? part[0] : 1 - part[0]) * (j != 0 ? part[1] : 1 - part[1]) * (k != 0 ? part[2] : 1 - part[2]);
    if (weight > 0) sum += weight * static_cast<double>(values[grid.index(base[0] + i, base[1] + j, base[2] + k)]);
  }
  return sum;
}

ScalarGrid ScalarGrid::sample(const Field& field, const Grid& grid) {
  ScalarGrid out{grid, std::vector<float>(grid.voxels())};
  tbb::parallel_for(0, grid.size[2], [&](int k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        out.values[grid.index(i, j, k)] = static_cast<float>(field(grid.point(i, j, k)));
      }
    }
  });
  return out;
}

Eigen::Vector3d gradient(const Field& field, const Eigen::Vector3d& point_mm, double step_mm) {
  Eigen::Vector3d out;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = Eigen::Vector3d::Unit(axis) * step_mm;
    out[axis] = (field(point_mm + step) - field(point_mm - step)) / (2 * step_mm);
  }
  return out;
}

Eigen::Vector3d march_to_level(const Field& field, double level, const Eigen::Vector3d& start_mm,
                               const Eigen::Vector3d& direction, double length_mm, double step_mm) {
  const bool above_at_start = field(start_mm) > level;
  const int steps = static_cast<int>(length_mm / step_mm);
  for (int step = 1; step <= steps; ++step) {
    const double s = step * step_mm;
    if ((field(start_mm + s * direction) > level) != above_at_start) {
      double low = s - step_mm;
      double high = s;
      for (int i = 0; i < 30; ++i) {
        const double middle = 0.5 * (low + high);
        ((field(start_mm + middle * direction) > level) != above_at_start ? high : low) = middle;
      }
      return start_mm + 0.5 * (low + high) * direction;
    }
  }
  return start_mm + length_mm * direction;
}

}  // namespace birdseye::hw_sim
