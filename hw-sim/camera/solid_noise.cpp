#include "hw-sim/camera/solid_noise.hpp"

#include <cmath>

#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

SolidNoise::SolidNoise(std::uint64_t seed) : cells_(std::size_t{kPeriod} * kPeriod * kPeriod) {
  const auto lattice = [seed](int i, int j, int k) {
    const int at = ((k % kPeriod) * kPeriod + j % kPeriod) * kPeriod + i % kPeriod;
    return std::floor(256 * hashed_uniform(seed, static_cast<std::uint64_t>(at)));
  };
  auto cell = cells_.begin();
  for (int k = 0; k < kPeriod; ++k) {
    for (int j = 0; j < kPeriod; ++j) {
      for (int i = 0; i < kPeriod; ++i, ++cell) {
        for (int corner = 0; corner < 4; ++corner) {
          cell->near[corner] = static_cast<float>(lattice(i, j + corner % 2, k + corner / 2));
          cell->far[corner] = static_cast<float>(lattice(i + 1, j + corner % 2, k + corner / 2));
        }
      }
    }
  }
}

float SolidNoise::at(const Eigen::Vector3f& point) const {
  int base[3];
  float t[3];
  for (int axis = 0; axis < 3; ++axis) {
    // Not std::floor: without SSE 4.1, which we do not ask for, it is a call, and this line runs millions of times.
    const int truncated = static_cast<int>(point[axis]);
    base[axis] = truncated - (point[axis] < static_cast<float>(truncated) ? 1 : 0);
    const float part = point[axis] - static_cast<float>(base[axis]);
    t[axis] = part * part * (3.0F - 2.0F * part);
  }
  constexpr int kMask = kPeriod - 1;
  const int at = ((base[2] & kMask) * kPeriod + (base[1] & kMask)) * kPeriod + (base[0] & kMask);
  const Cell& cell = cells_[static_cast<std::size_t>(at)];
  const auto mix = [](float a, float b, float u) { return a + (b - a) * u; };
  const Eigen::Array4f along_x = cell.near + (cell.far - cell.near) * t[0];
  return mix(mix(along_x[0], along_x[1], t[1]), mix(along_x[2], along_x[3], t[1]), t[2]) * (1.0F / 255);
}

}  // namespace birdseye::hw_sim
