#pragma once

#include <vector>

#include "host/registration/geometry/seen_point.hpp"
#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

/// Places of the surface that outlines in the pictures ask for: where colours change from the organ's to those about
/// it, along lines across the outline that the surface has now, and there the place of the pixel's ray that is closest
/// to the surface. Kept is what lies within most_mm of it, off the lens's rim.
std::vector<SeenPoint> outline_points(const std::vector<PinholeView>& views, const SeenSurface& surface,
                                      double most_mm);

}  // namespace birdseye::host
