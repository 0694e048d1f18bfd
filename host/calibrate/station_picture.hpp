#pragma once

#include <string>
#include <vector>

#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// One station of a hand-eye calibration, as the board sees it.
struct StationMark {
  Transform<Camera, Marker> camera_from_marker;
  bool odd = false;       ///< drawn in red
  std::string name = {};  ///< written beside it where it is odd, or there are few
};

/// An SVG of where the scope looked from. On the left the lines of sight as seen from straight above the board: the
/// farther out, the more tilted; a tick for each shows the direction of the picture's upper edge (roll). Beside it the
/// camera's places seen from the side and from above, with ticks along the line of sight.
std::string station_picture_svg(const std::vector<StationMark>& stations);

}  // namespace birdseye::host
