#pragma once

#include <vector>

#include "calibration/detect/grid_points.hpp"

namespace birdseye::calibration {

/// The steepest edge of each small part of the picture that has one, and how wide it is: how sharp a picture is in
/// which no pattern was found.
std::vector<EdgeWidth> edges_of_picture(const GreyView& picture);

/// Edges wider than this, and a corner is known to some tenths of a pixel only.
inline constexpr double kWidestEdge_px = 12;
/// Whether the median of edges_of_picture is so wide that searching the picture is of no use.
bool is_blurred(const GreyView& picture);

/// How much light and dark differ within some ten pixels, grey levels, in the tenth of the picture that has most
/// contrast.
double local_contrast(const GreyView& picture);

/// The share of the pattern's dark places that are saturated: dark squares and dots within the outline of the points
/// found, and those whose place follows from found neighbours.
double glare_of(const Pattern& pattern, const GreyView& picture, const std::vector<int>& ids,
                const std::vector<Eigen::Vector2d>& points_px);

}  // namespace birdseye::calibration
