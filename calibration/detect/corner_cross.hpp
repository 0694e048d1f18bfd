#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calibration/detect/grid_points.hpp"

namespace birdseye::calibration {

/// Where four squares of a chessboard meet, as far as it is known.
struct Cross {
  Eigen::Vector2d centre_px;
  Eigen::Matrix2d px_per_square;  ///< the board's x and y there, px for one square
  bool dark_ahead = false;        ///< the square towards +x, +y is dark
};

/// How far around a cross the picture is used, in squares: along the edges, and to either side of them. Tags begin
/// farther to the side than that.
struct CrossReach {
  double along = 0, aside = 0;
};

/// The picture made smooth for refine_cross, which takes gradients from it.
class SmoothPicture {
 public:
  explicit SmoothPicture(const GreyView& picture);
  [[nodiscard]] GreyView view() const;

 private:
  int width_px_, height_px_;
  std::vector<std::uint8_t> grey_;
};

/// The cross's centre: the point to which the gradients at all edges stand at right angles (Förstner and Gülch 1987),
/// from pixels beside the four edges alone. Empty where the search leads away from the cross or out of the picture.
std::optional<Eigen::Vector2d> refine_cross(const GreyView& smooth, const Cross& cross, const CrossReach& reach);

struct CrossLook {
  bool is_cross = false;  ///< light and dark lie along all four edges as they should
  double contrast = 0;
  std::vector<EdgeWidth> edges;
};
CrossLook look_at_cross(const GreyView& picture, const Cross& cross, const CrossReach& reach);

}  // namespace birdseye::calibration
