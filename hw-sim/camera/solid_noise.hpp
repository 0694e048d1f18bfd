#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace birdseye::hw_sim {

/// A smooth random scalar over space in [0, 1], one feature per unit length, repeating every 32 units. Its lattice is
/// of bytes, so that all of it stays in a core's nearest cache.
class SolidNoise {
 public:
  explicit SolidNoise(std::uint64_t seed);
  [[nodiscard]] float at(const Eigen::Vector3f& point) const;

 private:
  static constexpr int kPeriod = 32;
  std::vector<std::uint8_t> lattice_;
};

}  // namespace birdseye::hw_sim
