#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host/render/scene/scene.hpp"

namespace birdseye::host {

/// The overlay over one video frame of the same size: out = overlay * strength + video * (1 - alpha * strength).
/// video: RGB, rows from the top; strength in [0, 1]. An overlay of another size is not drawn.
/// in_front: of each pixel, how much of the video stays before the overlay, 0 to 255 (surface_cues.hpp); empty:
/// nothing.
std::vector<std::uint8_t> composite(std::span<const std::uint8_t> video, const ImageRgba& overlay, double strength,
                                    std::span<const std::uint8_t> in_front = {});

}  // namespace birdseye::host
