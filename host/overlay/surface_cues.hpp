#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace birdseye::host {

/// How much of each pixel of the video, 0 to 255, is to stay before an overlay so that what is drawn reads as lying
/// beneath the surface: its edges, folds and highlights. An overlay that hides them seems to float before the organ
/// (Kalkofen et al., Interactive focus and context visualization for augmented reality, ISMAR 2007).
/// video: RGB, 8 bits, rows from the top.
std::vector<std::uint8_t> surface_cues(std::span<const std::uint8_t> video, int width_px, int height_px);

}  // namespace birdseye::host
