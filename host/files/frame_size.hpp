#pragma once

#include <cstdint>

namespace birdseye::host {

/// The most pixels of a frame that is recorded or played: no camera of an appliance has more (drivers::kMostPixels).
inline constexpr std::int64_t kMostFramePixels = std::int64_t{4096} * 4096;

/// Of the longer side, so that none is nearly all padding.
inline constexpr std::int64_t kMostFrameSide_px = 16384;

constexpr bool is_frame_size(std::int64_t width_px, std::int64_t height_px) {
  return width_px > 0 && height_px > 0 && width_px <= kMostFrameSide_px && height_px <= kMostFrameSide_px &&
         width_px * height_px <= kMostFramePixels;
}

}  // namespace birdseye::host
