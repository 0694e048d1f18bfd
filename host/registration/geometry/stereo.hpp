#pragma once

#include <vector>

#include "host/registration/geometry/seen_point.hpp"
#include "host/registration/geometry/seen_surface.hpp"

namespace birdseye::host {

struct StereoSettings {
  double grid_px = 12;  ///< a patch every so many pixels of a picture 768 wide
  double span_mm = 12;  ///< how far in front of and behind the surface it is looked for, in depth
  double step_mm = 0.5;
};

/// Places of the surface by which small patches of one view are found again in the others: a plane sweep along the
/// rays about the surface as it is believed to be, by the mean normalised cross-correlation over the views that see it.
/// Kept are peaks that are high, alone and not at the span's ends, and that lie with their neighbours on a plane.
std::vector<SeenPoint> stereo_points(const std::vector<PinholeView>& views, const SeenSurface& surface,
                                     const StereoSettings& settings);

}  // namespace birdseye::host
