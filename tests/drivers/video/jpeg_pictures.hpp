#pragma once

#include <cstdint>
#include <cstdio>  // for jpeglib.h
#include <cstdlib>
#include <vector>

#include <jpeglib.h>

namespace birdseye::test {

/// A smooth picture, RGB, so that JPEG comes near it.
inline std::vector<std::uint8_t> smooth_picture(int width_px, int height_px) {
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < height_px; ++y) {
    for (int x = 0; x < width_px; ++x) {
      rgb.push_back(static_cast<std::uint8_t>(40 + 150 * x / width_px));
      rgb.push_back(static_cast<std::uint8_t>(200 - 150 * y / height_px));
      rgb.push_back(static_cast<std::uint8_t>(60 + 100 * (x + y) / (width_px + height_px)));
    }
  }
  return rgb;
}

inline std::vector<std::uint8_t> encode_jpeg(std::vector<std::uint8_t> rgb, int width_px, int height_px,
                                             bool progressive = false) {
  jpeg_compress_struct jpeg;
  jpeg_error_mgr errors;
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&jpeg, &bytes, &size);
  jpeg.image_width = static_cast<JDIMENSION>(width_px);
  jpeg.image_height = static_cast<JDIMENSION>(height_px);
  jpeg.input_components = 3;
  jpeg.in_color_space = JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, 92, TRUE);
  if (progressive) jpeg_simple_progression(&jpeg);
  jpeg_start_compress(&jpeg, TRUE);
  for (int y = 0; y < height_px; ++y) {
    JSAMPROW row = rgb.data() + std::size_t{3} * static_cast<unsigned>(y) * static_cast<unsigned>(width_px);
    jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::vector<std::uint8_t> out(bytes, bytes + size);
  std::free(bytes);
  return out;
}

}  // namespace birdseye::test
