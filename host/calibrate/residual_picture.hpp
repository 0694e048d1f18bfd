#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

namespace birdseye::host {

/// What a fit leaves at a place of the picture: seen minus predicted.
struct PixelResidual {
  Eigen::Vector2d pixel_px, residual_px;
  bool outlier = false;  ///< drawn in red, and never left out
};

/// An SVG of the picture's frame with an arrow for each point, from where the point was predicted towards where it was
/// seen. Arrows are drawn `times` longer than they are (0: the round number that makes the median arrow readable), and
/// cut where they would hide others; a scale says by how much. Of more than some thousands only every n-th is drawn.
/// image: what lies under the arrows, as data_url() gives it; empty: nothing.
std::string residual_picture_svg(std::span<const PixelResidual> residuals, int width_px, int height_px,
                                 double times = 0, const std::string& image = {});

/// An SVG of the picture's frame cut into columns x rows cells. A cell is the darker the more points it holds, and
/// shows their number; a cell without points stays white.
std::string coverage_picture_svg(std::span<const Eigen::Vector2d> points_px, int width_px, int height_px, int columns,
                                 int rows);

}  // namespace birdseye::host
