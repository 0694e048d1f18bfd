#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <fstream>

namespace birdseye::testing {

/// Row by row, with every digit that a double has.
inline void write_matrix(const std::filesystem::path& path, const Eigen::Matrix4d& m) {
  std::ofstream out(path);
  out.precision(17);
  out << m << "\n";
}

}  // namespace birdseye::testing
