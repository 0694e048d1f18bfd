#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace birdseye::hw_sim {

/// What a scope sees that rides on the first bird of a miniBIRD's circle and looks inwards at a patterned post, which
/// stands on the circle's middle, its axis the circle's. The pattern is given to each pixel once; a picture then costs
/// no more than a look into a table, so that a machine whose window is measured has its time for the window.
///
/// The scope: x of its picture along the circle, the way the bird goes; y along the axis, downwards; its lens a pinhole
/// of focal length 0.78 times the picture's width, in the middle, kFromAxisMm before the axis. Behind the post is a
/// round wall about the same axis.
class PostView {
 public:
  static constexpr double kFromAxisMm = 130, kPostRadiusMm = 60, kWallRadiusMm = 400, kFocalPerWidth = 0.78;

  PostView(int width_px, int height_px);

  /// RGB, row by row, with the bird turned by this angle from the start of its circle. Valid until the next call.
  std::span<const std::uint8_t> draw(double angle_rad);

 private:
  struct Place {
    std::uint32_t angle;  ///< in columns of the pattern, with the bird at the start of its circle
    std::uint32_t row;    ///< where the pattern's row begins
  };

  std::vector<std::uint8_t> pattern_;
  std::array<std::array<std::uint8_t, 3>, 256> colours_{};
  std::vector<Place> places_;  ///< of each pixel
  std::vector<std::uint8_t> picture_;
};

}  // namespace birdseye::hw_sim
