#include "hw-sim/video/half_size.hpp"

#include <cstddef>

namespace birdseye::hw_sim {

std::vector<std::uint8_t> half_size_of(std::span<const std::uint8_t> rgb, int width_px, int height_px) {
  std::vector<std::uint8_t> half;
  for (int y = 0; y + 1 < height_px; y += 2) {
    for (int x = 0; x + 1 < width_px; x += 2) {
      const auto pixel = rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * width_px + x);
      half.insert(half.end(), pixel, pixel + 3);
    }
  }
  return half;
}

}  // namespace birdseye::hw_sim
