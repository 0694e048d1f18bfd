#pragma once

#include <span>
#include <vector>

#include "host/registration/geometry/seen_point.hpp"
#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

/// One point in place of neighbours of one kind: their middle, as far off the surface as they are by a mean that
/// outliers do not move, and with their shift, which must be one. Its sigma is of their spread, and no less than what
/// they have wrong together. Fewer points, each better, make a fit both faster and more exact.
std::vector<SeenPoint> gathered_points(std::span<const SeenPoint> points, const SeenSurface& surface);

}  // namespace birdseye::host
