#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace birdseye::hw_sim {

/// A smooth random scalar over space in [0, 1], one feature per unit length, repeating every 32 units.
class SolidNoise {
 public:
  explicit SolidNoise(std::uint64_t seed);
  [[nodiscard]] float at(const Eigen::Vector3f& point) const;

 private:
  static constexpr int kPeriod = 32;
  /// Values at the corners of a cell of the lattice, of 0 to 255: those at the near and at the far end along X, each
  /// four in the order of Y, then Z. Eight lie together, for they are asked for together, millions of times: a
  /// megabyte.
  struct Cell {
    Eigen::Array4f near, far;
  };
  std::vector<Cell> cells_;
};

}  // namespace birdseye::hw_sim
