#pragma once

#include "calibration/geometry/camera_model.hpp"

namespace birdseye::testing {

/// A laparoscope-like lens for tests: barrel distortion, pixels not quite square, its centre off the picture's.
inline CameraModel wide_lens(int width_px = 768, int height_px = 576) {
  const double scale = width_px / 768.0;
  CameraModel c;
  c.width_px = width_px;
  c.height_px = height_px;
  c.fx_px = 598.4 * scale;
  c.fy_px = 611.9 * scale;
  c.cx_px = 391.3 * scale;
  c.cy_px = 281.9 * scale;
  c.k1 = -0.305;
  c.k2 = 0.098;
  c.p1 = 0.0011;
  c.p2 = -0.0007;
  c.k3 = 0.004;
  return c;
}

}  // namespace birdseye::testing
