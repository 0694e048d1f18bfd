#include "hw-sim/case/tissue_map.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>
#include <vector>

namespace birdseye::hw_sim {

using Eigen::Vector3d;

Mesh deformed(const Mesh& rest, const TissueMap& map) {
  Mesh out = rest;
  tbb::parallel_for(std::size_t{0}, out.vertices.size(), [&](std::size_t i) {
    out.vertices[i] = map.deformed_of(rest.vertices[i].cast<double>()).cast<float>();
  });
  compute_normals(out);
  return out;
}

double least_over_lattice(const Vector3d& low_mm, const Vector3d& high_mm, int points,
                          const std::function<double(const Vector3d&)>& value_at) {
  std::vector<double> least(static_cast<std::size_t>(points), std::numeric_limits<double>::max());
  tbb::parallel_for(0, points, [&](int k) {
    double& of_slice = least[static_cast<std::size_t>(k)];
    for (int j = 0; j < points; ++j) {
      for (int i = 0; i < points; ++i) {
        const Vector3d t = Vector3d(i, j, k) / (points - 1);
        of_slice = std::min(of_slice, value_at(low_mm + t.cwiseProduct(high_mm - low_mm)));
      }
    }
  });
  return *std::min_element(least.begin(), least.end());
}

}  // namespace birdseye::hw_sim
