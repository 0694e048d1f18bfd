#include "host/overlay/hole.hpp"

#include <algorithm>
#include <cmath>

namespace birdseye::host {

namespace {

// Of 255: how much the ground hides, in the hole's middle and at the wall, and the rim's grey.
constexpr double kGround = 150, kWall = 215, kRim = 205;
// The wall begins at this part of the radius.
constexpr double kWallFrom = 0.82;

}  // namespace

ImageRgba in_hole(const ImageRgba& overlay, double radius) {
  ImageRgba out{overlay.width_px, overlay.height_px, std::vector<std::uint8_t>(overlay.rgba.size())};
  const double radius_px = radius * overlay.height_px, rim_px = std::max(1.0, overlay.height_px / 360.0);
  const double middle_x = 0.5 * (overlay.width_px - 1), middle_y = 0.5 * (overlay.height_px - 1);
  for (int y = 0; y < overlay.height_px; ++y) {
    for (int x = 0; x < overlay.width_px; ++x) {
      const double from_middle_px = std::hypot(x - middle_x, y - middle_y);
      if (from_middle_px > radius_px) continue;
      const std::size_t at =
          4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(overlay.width_px) + static_cast<std::size_t>(x));
      if (from_middle_px > radius_px - rim_px) {
        std::fill_n(&out.rgba[at], 3, static_cast<std::uint8_t>(kRim));
        out.rgba[at + 3] = 255;
        continue;
      }
      const double towards_wall = std::clamp((from_middle_px / radius_px - kWallFrom) / (1 - kWallFrom), 0.0, 1.0);
      const double ground = kGround + towards_wall * (kWall - kGround);
      // The overlay over black of that opacity; black adds nothing to its colours.
      const int alpha = overlay.rgba[at + 3];
      std::copy_n(&overlay.rgba[at], 3, &out.rgba[at]);
      out.rgba[at + 3] = static_cast<std::uint8_t>(std::lround(alpha + ground * (255 - alpha) / 255));
    }
  }
  return out;
}

}  // namespace birdseye::host
