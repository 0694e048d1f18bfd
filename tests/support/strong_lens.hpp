#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "calibration/geometry/camera_model.hpp"

namespace birdseye::testing {

/// The lens of a laparoscope (k1, k2 as published for a Storz 3D, its picture wider than its published one is), which
/// moves the picture's corners by tens of pixels.
inline CameraModel strong_lens(int width_px = 384, int height_px = 288) {
  const double scale = width_px / 384.0;
  CameraModel c;
  c.width_px = width_px;
  c.height_px = height_px;
  c.fx_px = 300 * scale;
  c.fy_px = 303 * scale;
  c.cx_px = 185.3 * scale;
  c.cy_px = 149.6 * scale;
  c.k1 = -0.4304;
  c.k2 = 0.2426;
  c.p1 = 0.002;
  c.p2 = -0.001;
  return c;
}

/// Of 60 degrees and more off its axis at the rim, where its polynomial has folded.
inline CameraModel folding_lens() {
  CameraModel c = strong_lens();
  c.fx_px = c.fy_px = 200;
  c.k1 = -0.4;
  c.k2 = c.p1 = c.p2 = 0;
  return c;
}

/// Whether the pixel is so far from the picture's rim.
inline bool within(const CameraModel& c, const Eigen::Vector2d& pixel, double margin_px) {
  return pixel.x() >= margin_px && pixel.y() >= margin_px && pixel.x() <= c.width_px - 1 - margin_px &&
         pixel.y() <= c.height_px - 1 - margin_px;
}

/// A smooth coloured picture with edges nowhere, so that resampling it changes little.
inline std::vector<std::uint8_t> smooth_frame(const CameraModel& c) {
  std::vector<std::uint8_t> rgb;
  for (int y = 0; y < c.height_px; ++y) {
    for (int x = 0; x < c.width_px; ++x) {
      rgb.push_back(static_cast<std::uint8_t>(std::lround(128 + 60 * std::sin(x / 17.0) * std::cos(y / 23.0))));
      rgb.push_back(static_cast<std::uint8_t>(60 + 100 * x / c.width_px));
      rgb.push_back(static_cast<std::uint8_t>(200 - 100 * y / c.height_px));
    }
  }
  return rgb;
}

}  // namespace birdseye::testing
