#include "host/overlay/overlay_look.hpp"

#include <algorithm>
#include <cmath>

#include "host/overlay/surface_cues.hpp"

namespace birdseye::host {

std::string name_of(OverlayStyle style) {
  return style == OverlayStyle::outlines ? "outlines" : "filled";
}

std::vector<std::uint8_t> lay_over(std::span<const std::uint8_t> video, const ImageRgba& overlay, double strength,
                                   const OverlayLook& look) {
  std::vector<std::uint8_t> out(video.begin(), video.end());
  const std::size_t pixels = overlay.rgba.size() / 4;
  if (video.size() != 3 * pixels) return out;
  std::vector<std::uint8_t> in_front;
  // Within a hole there is no surface left to stay in front.
  if (look.surface_in_front && !look.hole_radius) in_front = surface_cues({video, overlay.width_px, overlay.height_px});
  // Eight bits of fraction: 256 is all of it.
  const int whole = static_cast<int>(std::lround(std::clamp(strength * look.opacity, 0.0, 1.0) * 256));
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint8_t* const rgba = &overlay.rgba[4 * i];
    if (rgba[3] == 0) continue;
    const int w = in_front.size() == pixels ? whole * (255 - in_front[i]) / 255 : whole;
    const int keep = 255 * 256 - rgba[3] * w;
    for (std::size_t c = 0; c < 3; ++c) {
      const int value = rgba[c] * w * 255 + video[3 * i + c] * keep;
      out[3 * i + c] = static_cast<std::uint8_t>(std::min(255, (value + 255 * 128) / (255 * 256)));
    }
  }
  return out;
}

}  // namespace birdseye::host
