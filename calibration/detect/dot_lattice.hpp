#pragma once

#include <vector>

#include "calibration/detect/dot_blobs.hpp"
#include "calibration/detect/grid_points.hpp"

namespace birdseye::calibration {

/// The largest set of spots that stand in rows and columns, found by stepping from spot to spot. GridPoint::id is the
/// spot's index. Places are counted from any one of them; the axes are the two shortest steps of the lattice, turned so
/// that the second is clockwise of the first as one sees the picture. Stops early at `enough` spots.
std::vector<GridPoint> grow_dot_lattice(const std::vector<DotBlob>& blobs, std::size_t enough);

/// What the lattice around a dot says of it.
struct DotLook {
  double diameter_steps = 0;  ///< of a disc of its area, in steps of the lattice
  Eigen::Vector2d centre_px;  ///< where the disc's centre projects to
};

/// Under perspective and distortion the centroid of a disc's picture is not the picture of its centre. With the local
/// map m(d) = a + J d + 1/2 H[d, d] and the disc's radius r, both in steps, area changes over the disc by the gradient
/// g_k = tr(J^-1 dJ/dd_k) and to second order the centroid lies at a + r^2/4 (J g + (hxx + hyy)/2): the mean of m
/// weighted by 1 + g.d, where the mean of d d' is r^2/4. Element by element as `points`; the same steps must be equally
/// long on the pattern and at right angles. Without a local map there is no correction and no diameter (0).
std::vector<DotLook> look_at_dots(const std::vector<GridPoint>& points, const std::vector<DotBlob>& blobs);

}  // namespace birdseye::calibration
