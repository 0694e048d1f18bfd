#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace birdseye::drivers {

enum class PixelFormat { rgb8, bgr8, yuyv, grey8 };

std::optional<PixelFormat> pixel_format_of_fourcc(std::uint32_t fourcc);
std::size_t bytes_per_pixel(PixelFormat format);

/// Packed pixels of any of the formats -> RGB. YUYV is ITU-R BT.601, limited range. stride: bytes from row to row.
std::vector<std::uint8_t> to_rgb(std::span<const std::uint8_t> pixels, PixelFormat format, int width_px, int height_px,
                                 std::size_t stride);

}  // namespace birdseye::drivers
