#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/detect/grid_points.hpp"

namespace birdseye::calibration {

/// An elliptic spot of a picture.
struct DotBlob {
  Eigen::Vector2d centroid_px;  ///< weighted by how far the grey is from the ground's
  Eigen::Matrix2d spread_px2;   ///< second moments about the centroid; of an ellipse a quarter of its shape matrix
  double area_px2 = 0;          ///< by the same weights: blur does not change it
  double contrast = 0;          ///< ground less dot, grey levels, above 0
};

/// Spots darker (or lighter) than the mean of the window of window_px around them. Spots that the border cuts are left
/// out.
std::vector<DotBlob> find_dot_blobs(const GreyView& picture, bool dark, int window_px);

/// Widths of a spot's edge, at several places around it.
std::vector<EdgeWidth> dot_edges(const GreyView& picture, const DotBlob& blob);

}  // namespace birdseye::calibration
