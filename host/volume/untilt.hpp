#pragma once

#include <string>
#include <vector>

#include "host/dicom/slice_stack.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

/// What resampling costs, mm: the standard deviation of the blur of linear interpolation; the root mean square over all
/// slices, and that of the worst.
struct UntiltCost {
  double blur_mm = 0, worst_blur_mm = 0;      ///< within slices, along the way in which they were shifted
  double across_mm = 0, worst_across_mm = 0;  ///< from slice to slice; 0 where these keep their distances
};

/// Shifts slices that lie beside one another back onto a straight stack: each within its own plane, by linear
/// interpolation, into a grid that holds all of them, with -1024 HU where there is no slice. image: size, spacing, axes
/// and HU of the slices as they are; its size, origin and HU change. stack: whose slices these are; where their
/// distances are uneven, they are interpolated to its usual one.
UntiltCost untilt(const SliceStack& stack, ImageFile& image);

}  // namespace birdseye::host
