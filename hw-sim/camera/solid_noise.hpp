#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace birdseye::hw_sim {

/// A smooth random scalar over space in [0, 1], one feature per unit length, repeating every 64 units.
class SolidNoise {
 public:
  explicit SolidNoise(std::uint64_t seed);
  [[nodiscard]] float at(const Eigen::Vector3f& point) const;

 private:
  static constexpr int kPeriod = 64;
  std::vector<float> lattice_;
};

}  // namespace birdseye::hw_sim
