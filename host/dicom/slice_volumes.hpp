#pragma once

#include <string>
#include <vector>

#include "host/dicom/dicom_file.hpp"

namespace birdseye::host {

/// Slices of one volume of a series, and what tells them from those of its other volumes; empty where there is but one.
struct SliceVolume {
  std::vector<DicomSlice> slices;
  std::string part;
};

/// Parts the slices of a series: by size, spacing and orientation; then, where slices lie at the same places, by the
/// first SliceKey after which none do, or by the numbers of their images where these alone tell. Slices that nothing
/// tells apart stay together.
std::vector<SliceVolume> part_into_volumes(const std::vector<DicomSlice>& slices);

}  // namespace birdseye::host
