#pragma once

#include <string>
#include <vector>

#include "host/dicom/dicom_file.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

/// What resampling costs, mm: the standard deviation of the blur that interpolation lays over a slice, along the way in
/// which it was shifted; of the root mean square over all slices, and of the worst slice.
struct UntiltCost {
  double blur_mm = 0, worst_blur_mm = 0;
};

/// Shifts slices that lie beside one another back onto a straight stack: each within its own plane, by linear
/// interpolation, into a grid that holds all of them, with -1024 HU where there is no slice. image: size, spacing, axes
/// and HU of the slices as they are; its size, origin and HU change. slices: their places, in the order of the stack.
UntiltCost untilt(const std::vector<DicomSlice>& slices, ImageFile& image);

}  // namespace birdseye::host
