#pragma once

#include "calibration/detect/grid_points.hpp"

namespace birdseye::calibration {

/// Of a ChArUco board with a chessboard in its middle: takes away the board's corners that the chessboard covers, and
/// adds those of the chessboard, where the board's own say that they are: from six of these on. With twelve corners of
/// both the pattern is found.
void add_inset(const Pattern& pattern, const GreyView& picture, FoundPattern& found);

}  // namespace birdseye::calibration
