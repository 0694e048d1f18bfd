#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace birdseye::hw_sim {

/// The view of a scope on a post. The scope rides on the first bird of a miniBIRD's circle and looks inwards. The post
/// has a pattern, and stands in the circle's middle along the circle's axis; behind the post is a round wall about the
/// same axis. Where each pixel looks is worked out once. A picture then costs a look into a table for each pixel, so
/// that a machine whose window is measured has its time for the window.
///
/// The scope's picture: x is the way that the bird goes, y is down the axis. The lens is a pinhole, kFromAxisMm before
/// the axis, with a focal length of kFocalPerWidth times the picture's width.
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
