#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

/// Numbers drawn one after another from a seed.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : seed_(seed) {}

  double uniform(double low, double high) { return low + (high - low) * hashed_uniform(seed_, key_++); }
  double normal() { return hashed_normal(seed_, key_++); }
  /// A unit vector, all directions alike.
  Eigen::Vector3d direction() {
    const double x = normal();
    const double y = normal();
    return Eigen::Vector3d(x, y, normal()).normalized();
  }
  /// A unit vector up to so far from a given one.
  Eigen::Vector3d about(const Eigen::Vector3d& unit, double most_rad) {
    return (unit + std::tan(uniform(0, most_rad)) * unit.cross(direction()).normalized()).normalized();
  }
  /// One of so many, from 0.
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(uniform(0, 1) * static_cast<double>(count)); }

 private:
  std::uint64_t seed_, key_ = 0;
};

}  // namespace birdseye::hw_sim
