#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/render/scene.hpp"

namespace birdseye::host {

/// The overlay over one video frame of the same size: out = overlay * strength + video * (1 - alpha * strength).
/// video: RGB, rows from the top; strength in [0, 1]. An overlay of another size is not drawn.
std::vector<std::uint8_t> composite(std::span<const std::uint8_t> video, const ImageRgba& overlay, double strength);

}  // namespace birdseye::host
