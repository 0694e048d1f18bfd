#pragma once

#include <string>
#include <vector>

#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// One station of a hand-eye calibration, as the board sees it.
struct StationMark {
  Transform<Camera, Marker> camera_from_marker;
  bool odd = false;  ///< drawn in red
};

/// An SVG of where the scope looked from: the lines of sight as seen from straight above the board, the further out the
/// more tilted, with a tick for the direction of the picture's upper edge, that is for roll; and, beside it, the
/// camera's places from the side.
std::string station_picture_svg(const std::vector<StationMark>& stations);

}  // namespace birdseye::host
