#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace birdseye::host {

/// How a picture of grey values is stored.
struct PixelBits {
  int allocated = 16, stored = 16;
  bool is_signed = false;
};

/// The picture of a JPEG 2000 codestream as it is stored, so many bits allocated a pixel; empty where it is damaged, or
/// of another size.
std::optional<std::vector<std::uint8_t>> decode_jpeg2000(std::span<const std::uint8_t> stream, int columns, int rows,
                                                         const PixelBits& bits);

}  // namespace birdseye::host
