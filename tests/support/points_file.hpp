#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <vector>

namespace birdseye::testing {

/// Points as the public data sets have them: three numbers each, and nothing else.
inline std::vector<Eigen::Vector3d> read_points(const std::filesystem::path& path) {
  std::ifstream in(path);
  std::vector<Eigen::Vector3d> points;
  Eigen::Vector3d p;
  while (in >> p.x() >> p.y() >> p.z()) points.push_back(p);
  return points;
}

}  // namespace birdseye::testing
