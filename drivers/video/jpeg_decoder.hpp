#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace birdseye::drivers {

/// Decodes a picture of exactly this size to RGB. False for data that are damaged, cut short, of another size, or no
/// JPEG, and for progressive pictures, which no camera makes and which may take long although they are small.
/// Frames may lack their Huffman tables, as those of many USB cameras do.
bool decode_jpeg(std::span<const std::uint8_t> jpeg, int width_px, int height_px, std::vector<std::uint8_t>& rgb);

}  // namespace birdseye::drivers
