#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace birdseye::drivers {

enum class PixelFormat { rgb8, bgr8, yuyv, uyvy, nv12, mjpeg, grey8 };

/// The format of a Video4Linux code of four characters. Other names of the same format (JPEG, Y8) count too.
std::optional<PixelFormat> pixel_format_of_fourcc(std::uint32_t fourcc);
std::optional<PixelFormat> pixel_format_of_name(const std::string& name);
std::uint32_t fourcc_of(PixelFormat format);
/// The code's four characters; a dot for each that does not print.
std::string fourcc_name(std::uint32_t fourcc);

/// By which recommendation luma and chroma are made, and whether black is 0 and white 255 (full range) or 16 and 235.
struct YuvColour {
  enum class Matrix { bt601, bt709, bt2020 } matrix = Matrix::bt601;
  bool full_range = false;
};

/// How the pixels of a frame lie in memory. mjpeg has neither strides nor planes.
struct PixelLayout {
  PixelFormat format = PixelFormat::rgb8;
  int width_px = 0, height_px = 0;
  std::size_t stride = 0;         ///< bytes from row to row
  std::size_t chroma_offset = 0;  ///< of nv12: where its plane of chroma begins
  std::size_t chroma_stride = 0;
  YuvColour colour = {};
};

/// Rows without padding, planes without a hole between them.
PixelLayout packed_layout(PixelFormat format, int width_px, int height_px);
/// Bytes from the first pixel to the end of the last one; the last row's padding need not be there. 0 for mjpeg.
std::size_t bytes_needed(const PixelLayout& layout);

/// Pixels -> RGB, width * height * 3 bytes; chroma is that of the nearest sample. Asserts that there are bytes_needed()
/// bytes. For all formats but mjpeg, which decode_jpeg() takes.
void to_rgb(std::span<const std::uint8_t> pixels, const PixelLayout& layout, std::vector<std::uint8_t>& rgb);

}  // namespace birdseye::drivers
