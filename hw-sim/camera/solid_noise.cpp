#include "hw-sim/camera/solid_noise.hpp"

#include "hw-sim/base/hashed.hpp"

namespace birdseye::hw_sim {

SolidNoise::SolidNoise(std::uint64_t seed) : lattice_(std::size_t{kPeriod} * kPeriod * kPeriod) {
  for (std::size_t i = 0; i < lattice_.size(); ++i)
    lattice_[i] = static_cast<std::uint8_t>(256 * hashed_uniform(seed, i));
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
  const auto lattice = [&](int i, int j, int k) {
    constexpr int kMask = kPeriod - 1;
    const int at = (((base[2] + k) & kMask) * kPeriod + ((base[1] + j) & kMask)) * kPeriod + ((base[0] + i) & kMask);
    return static_cast<float>(lattice_[static_cast<std::size_t>(at)]);
  };
  const auto mix = [](float a, float b, float u) { return a + (b - a) * u; };
  const float low =
      mix(mix(lattice(0, 0, 0), lattice(1, 0, 0), t[0]), mix(lattice(0, 1, 0), lattice(1, 1, 0), t[0]), t[1]);
  const float high =
      mix(mix(lattice(0, 0, 1), lattice(1, 0, 1), t[0]), mix(lattice(0, 1, 1), lattice(1, 1, 1), t[0]), t[1]);
  return mix(low, high, t[2]) * (1.0F / 255);
}

}  // namespace birdseye::hw_sim
