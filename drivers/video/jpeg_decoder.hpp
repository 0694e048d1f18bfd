#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace birdseye::drivers {

/// A picture of exactly this size -> RGB. False for whatever is damaged, cut short, of another size, or no JPEG, and
/// for pictures in passes (progressive), which no camera makes and which can be small and yet take long.
/// Frames may lack their Huffman tables, as those of many USB cameras do.
bool decode_jpeg(std::span<const std::uint8_t> jpeg, int width_px, int height_px, std::vector<std::uint8_t>& rgb);

}  // namespace birdseye::drivers
