#pragma once

#include <algorithm>
#include <string>

namespace birdseye::host {

/// A picture in nine parts, three rows of three, numbered from the upper left; and the whole of it, kWholePicture.
inline constexpr int kPartsASide = 3, kWholePicture = kPartsASide * kPartsASide, kPictureParts = kWholePicture + 1;

inline int part_of(double x_px, double y_px, int width_px, int height_px) {
  const auto third = [](double at, int size) {
    return std::clamp(static_cast<int>(at * kPartsASide / size), 0, kPartsASide - 1);
  };
  return third(x_px, width_px) + kPartsASide * third(y_px, height_px);
}

}  // namespace birdseye::host
