#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace birdseye::hw_sim {

/// Every second pixel of every second row, as of a camera that skips the others. Both are RGB, rows from the top.
std::vector<std::uint8_t> half_size_of(std::span<const std::uint8_t> rgb, int width_px, int height_px);

}  // namespace birdseye::hw_sim
