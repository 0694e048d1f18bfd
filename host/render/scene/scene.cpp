#include "host/render/scene/scene.hpp"

#include <algorithm>

namespace birdseye::host {

std::vector<std::uint8_t> on_grey(const ImageRgba& image, std::uint8_t grey) {
  const std::size_t pixels = image.rgba.size() / 4;
  std::vector<std::uint8_t> out(3 * pixels, grey);
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint8_t* const rgba = &image.rgba[4 * i];
    if (rgba[3] == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const int value = rgba[c] * 255 + grey * (255 - rgba[3]);
      out[3 * i + c] = static_cast<std::uint8_t>(std::min(255, (value + 127) / 255));
    }
  }
  return out;
}

}  // namespace birdseye::host
