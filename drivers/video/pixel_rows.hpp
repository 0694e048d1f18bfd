#pragma once

#include <cstdint>

namespace birdseye::drivers {

/// How luma and chroma make red, green and blue: factors in 1/8192, less than 4 so that they fit 16 bits.
struct YuvMatrix {
  std::int16_t luma = 0, red_of_v = 0, green_of_u = 0, green_of_v = 0, blue_of_u = 0;
  std::int16_t black = 0;  ///< the luma of black
};

/// Where the bytes of luma and chroma lie in a row. Chroma is u, v, u, v in every packing.
enum class YuvPacking { luma_first, chroma_first, two_planes };

/// Converts one row to RGB. luma: the row's packed bytes, or with two_planes its luma alone. chroma: used with
/// two_planes only.
void yuv_row_to_rgb(const std::uint8_t* luma, const std::uint8_t* chroma, int width_px, YuvPacking packing,
                    const YuvMatrix& matrix, std::uint8_t* rgb);
void bgr_row_to_rgb(const std::uint8_t* bgr, int width_px, std::uint8_t* rgb);
void grey_row_to_rgb(const std::uint8_t* grey, int width_px, std::uint8_t* rgb);

}  // namespace birdseye::drivers
