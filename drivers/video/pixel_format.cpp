#include "drivers/video/pixel_format.hpp"

#include <array>
#include <cassert>
#include <cctype>
#include <cmath>
#include <cstring>

#include "drivers/video/pixel_rows.hpp"

namespace birdseye::drivers {

namespace {

constexpr std::uint32_t fourcc(const char (&name)[5]) {
  std::uint32_t code = 0;
  for (unsigned i = 0; i < 4; ++i) code |= static_cast<std::uint32_t>(name[i]) << 8U * i;
  return code;
}

struct FourccFormat {
  std::uint32_t fourcc;
  PixelFormat format;
};
// The first of each format is the one to ask for.
constexpr std::array kNamed = {
    FourccFormat{fourcc("RGB3"), PixelFormat::rgb8},  FourccFormat{fourcc("BGR3"), PixelFormat::bgr8},
    FourccFormat{fourcc("YUYV"), PixelFormat::yuyv},  FourccFormat{fourcc("UYVY"), PixelFormat::uyvy},
    FourccFormat{fourcc("NV12"), PixelFormat::nv12},  FourccFormat{fourcc("MJPG"), PixelFormat::mjpeg},
    FourccFormat{fourcc("JPEG"), PixelFormat::mjpeg}, FourccFormat{fourcc("GREY"), PixelFormat::grey8},
};

/// Bytes of width_px pixels in one row of the first plane.
std::size_t row_bytes(PixelFormat format, int width_px) {
  const auto width = static_cast<std::size_t>(width_px);
  switch (format) {
    case PixelFormat::yuyv:
    case PixelFormat::uyvy:
      return 4 * ((width + 1) / 2);
    case PixelFormat::nv12:
    case PixelFormat::grey8:
      return width;
    case PixelFormat::mjpeg:
      return 0;
    default:
      return 3 * width;
  }
}

/// Kr and Kb of the recommendations; the rest follows from them.
YuvMatrix matrix_of(const YuvColour& colour) {
  double kr = 0.299;
  double kb = 0.114;
  if (colour.matrix == YuvColour::Matrix::bt709) kr = 0.2126, kb = 0.0722;
  if (colour.matrix == YuvColour::Matrix::bt2020) kr = 0.2627, kb = 0.0593;
  const double kg = 1 - kr - kb;
  const double luma = colour.full_range ? 1 : 255.0 / 219;
  const double chroma = colour.full_range ? 1 : 255.0 / 224;
  const auto fixed = [](double factor) { return static_cast<std::int16_t>(std::lround(factor * 8192)); };
  YuvMatrix m;
  m.luma = fixed(luma);
  m.red_of_v = fixed(2 * (1 - kr) * chroma);
  m.green_of_u = fixed(-2 * (1 - kb) * kb / kg * chroma);
  m.green_of_v = fixed(-2 * (1 - kr) * kr / kg * chroma);
  m.blue_of_u = fixed(2 * (1 - kb) * chroma);
  m.black = colour.full_range ? 0 : 16;
  return m;
}

}  // namespace

std::optional<PixelFormat> pixel_format_of_fourcc(std::uint32_t code) {
  for (const FourccFormat& named : kNamed) {
    if (named.fourcc == code) return named.format;
  }
  return std::nullopt;
}

std::optional<PixelFormat> pixel_format_of_name(const std::string& name) {
  if (name.size() != 4) return std::nullopt;
  std::uint32_t code = 0;
  std::memcpy(&code, name.data(), 4);
  return pixel_format_of_fourcc(code);
}

std::uint32_t fourcc_of(PixelFormat format) {
  for (const FourccFormat& named : kNamed) {
    if (named.format == format) return named.fourcc;
  }
  return 0;
}

std::string fourcc_name(std::uint32_t code) {
  std::string name;
  for (unsigned i = 0; i < 4; ++i) {
    const unsigned letter = code >> 8U * i & 0xffU;
    name += letter > ' ' && letter < 127 ? static_cast<char>(letter) : '.';
  }
  return name;
}

PixelLayout packed_layout(PixelFormat format, int width_px, int height_px) {
  PixelLayout layout{format, width_px, height_px, row_bytes(format, width_px)};
  if (format == PixelFormat::nv12) {
    layout.chroma_offset = layout.stride * static_cast<std::size_t>(height_px);
    layout.chroma_stride = 2 * ((static_cast<std::size_t>(width_px) + 1) / 2);
  }
  return layout;
}

std::size_t bytes_needed(const PixelLayout& layout) {
  const auto height = static_cast<std::size_t>(layout.height_px);
  if (layout.format == PixelFormat::mjpeg || height == 0) return 0;
  const std::size_t first = layout.stride * (height - 1) + row_bytes(layout.format, layout.width_px);
  if (layout.format != PixelFormat::nv12) return first;
  const std::size_t chroma_row = 2 * ((static_cast<std::size_t>(layout.width_px) + 1) / 2);
  return std::max(first, layout.chroma_offset + layout.chroma_stride * ((height + 1) / 2 - 1) + chroma_row);
}

void to_rgb(std::span<const std::uint8_t> pixels, const PixelLayout& layout, std::vector<std::uint8_t>& rgb) {
  assert(pixels.size() >= bytes_needed(layout) && layout.format != PixelFormat::mjpeg);
  const int width_px = layout.width_px;
  const std::size_t rgb_stride = 3 * static_cast<std::size_t>(width_px);
  rgb.resize(rgb_stride * static_cast<std::size_t>(layout.height_px));
  const YuvMatrix matrix = matrix_of(layout.colour);
  for (std::size_t row = 0; row < static_cast<std::size_t>(layout.height_px); ++row) {
    const std::uint8_t* in = pixels.data() + row * layout.stride;
    std::uint8_t* out = rgb.data() + row * rgb_stride;
    switch (layout.format) {
      case PixelFormat::rgb8:
        std::memcpy(out, in, rgb_stride);
        break;
      case PixelFormat::bgr8:
        bgr_row_to_rgb(in, width_px, out);
        break;
      case PixelFormat::grey8:
        grey_row_to_rgb(in, width_px, out);
        break;
      case PixelFormat::yuyv:
        yuv_row_to_rgb(in, nullptr, width_px, YuvPacking::luma_first, matrix, out);
        break;
      case PixelFormat::uyvy:
        yuv_row_to_rgb(in, nullptr, width_px, YuvPacking::chroma_first, matrix, out);
        break;
      case PixelFormat::nv12:
        yuv_row_to_rgb(in, pixels.data() + layout.chroma_offset + row / 2 * layout.chroma_stride, width_px,
                       YuvPacking::two_planes, matrix, out);
        break;
      case PixelFormat::mjpeg:
        break;
    }
  }
}

}  // namespace birdseye::drivers
