#include "drivers/video/pixel_format.hpp"

#include <algorithm>

namespace birdseye::drivers {

namespace {

constexpr std::uint32_t fourcc(char a, char b, char c, char d) {
  return static_cast<std::uint32_t>(a) | static_cast<std::uint32_t>(b) << 8U | static_cast<std::uint32_t>(c) << 16U |
         static_cast<std::uint32_t>(d) << 24U;
}

/// BT.601 in 8.8 fixed point.
void yuv_to_rgb(int y, int u, int v, std::uint8_t* out) {
  const int c = 298 * (y - 16) + 128;
  const int d = u - 128;
  const int e = v - 128;
  const auto byte = [](int value) { return static_cast<std::uint8_t>(std::clamp(value >> 8, 0, 255)); };
  out[0] = byte(c + 409 * e);
  out[1] = byte(c - 100 * d - 208 * e);
  out[2] = byte(c + 516 * d);
}

}  // namespace

std::optional<PixelFormat> pixel_format_of_fourcc(std::uint32_t code) {
  switch (code) {
    case fourcc('R', 'G', 'B', '3'):
      return PixelFormat::rgb8;
    case fourcc('B', 'G', 'R', '3'):
      return PixelFormat::bgr8;
    case fourcc('Y', 'U', 'Y', 'V'):
      return PixelFormat::yuyv;
    case fourcc('G', 'R', 'E', 'Y'):
      return PixelFormat::grey8;
    default:
      return std::nullopt;
  }
}

std::size_t bytes_per_pixel(PixelFormat format) {
  switch (format) {
    case PixelFormat::yuyv:
      return 2;
    case PixelFormat::grey8:
      return 1;
    default:
      return 3;
  }
}

std::vector<std::uint8_t> to_rgb(std::span<const std::uint8_t> pixels, PixelFormat format, int width_px, int height_px,
                                 std::size_t stride) {
  const auto width = static_cast<std::size_t>(width_px);
  std::vector<std::uint8_t> rgb(width * static_cast<std::size_t>(height_px) * 3);
  for (std::size_t row = 0; row < static_cast<std::size_t>(height_px); ++row) {
    const std::uint8_t* in = pixels.data() + row * stride;
    std::uint8_t* out = rgb.data() + row * width * 3;
    switch (format) {
      case PixelFormat::rgb8:
        std::copy_n(in, width * 3, out);
        break;
      case PixelFormat::bgr8:
        for (std::size_t x = 0; x < width; ++x) std::reverse_copy(in + 3 * x, in + 3 * x + 3, out + 3 * x);
        break;
      case PixelFormat::grey8:
        for (std::size_t x = 0; x < width; ++x) std::fill_n(out + 3 * x, 3, in[x]);
        break;
      case PixelFormat::yuyv:
        for (std::size_t x = 0; x < width; ++x) {
          const std::uint8_t* pair = in + 4 * (x / 2);
          yuv_to_rgb(in[2 * x], pair[1], pair[3], out + 3 * x);
        }
        break;
    }
  }
  return rgb;
}

}  // namespace birdseye::drivers
