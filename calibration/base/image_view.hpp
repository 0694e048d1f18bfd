#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace birdseye {

/// A picture whose pixels somebody else owns and keeps for as long as it is looked at: 8 bits a channel, a pixel's
/// channels side by side, rows from the top without gaps.
template <std::size_t channels>
struct ImageView {
  std::span<const std::uint8_t> pixels;
  int width_px = 0, height_px = 0;

  [[nodiscard]] std::size_t area_px() const {
    return static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  }
  /// Are there as many bytes as width and height tell? The rest of this may be used only where there are.
  [[nodiscard]] bool whole() const { return pixels.size() == area_px() * channels; }
  /// The first byte of row y, from the top; y from 0 to height_px - 1.
  [[nodiscard]] const std::uint8_t* row(int y_px) const {
    return pixels.data() + static_cast<std::size_t>(y_px) * static_cast<std::size_t>(width_px) * channels;
  }
};

using GreyView = ImageView<1>;
using RgbView = ImageView<3>;
using RgbaView = ImageView<4>;

}  // namespace birdseye
