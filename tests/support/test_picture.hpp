#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace birdseye::testing {

/// The frame's number in the picture of `birdseye-sim camera`, modulo 2^32, from the 32 blocks along its top: block i
/// has the columns from i * b on, b = the width / 32 rounded down to an even number; white is 1; the first is bit 31.
/// Empty where a block is neither white nor black, or the pixels are too few. format: the Video4Linux name.
inline std::optional<std::uint32_t> number_in_picture(std::span<const std::uint8_t> pixels, std::string_view format,
                                                      int width_px) {
  const std::size_t step = format == "RGB3" || format == "BGR3" ? 3 : format == "YUYV" || format == "UYVY" ? 2 : 1;
  const std::size_t luma = format == "UYVY" ? 1 : 0;
  const auto width = static_cast<std::size_t>(width_px);
  const std::size_t block = width / 32 / 2 * 2;
  constexpr std::size_t kRow = 8;  // halfway down the blocks
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 32; ++i) {
    const std::size_t at = (kRow * width + i * block + block / 2) * step + luma;
    if (at >= pixels.size() || (pixels[at] > 64 && pixels[at] < 192)) return std::nullopt;
    number = 2 * number + (pixels[at] > 128 ? 1U : 0U);
  }
  return number;
}

}  // namespace birdseye::testing
