#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host/dicom/dicom_file.hpp"

namespace birdseye::host {

/// Slices in their order along their normal, and whether they are those of a volume.
struct SliceStack {
  std::vector<DicomSlice> slices;
  double step_mm = 0;    ///< along the normal
  double tilt_deg = 0;   ///< by how much the slices are shifted sideways, as by a tilted gantry; 0 where they are not
  bool doubled = false;  ///< two slices lie at the same place
  double usual_step_mm = 0;  ///< the median of uneven steps, where no slice is further from the next than it is thick
  std::string problem;       ///< why they are no volume, but for a tilt; empty where they are
};

/// What a slice is called in a message: its file's name, with its frame where the file has several.
using SliceName = std::function<std::string(const DicomSlice&)>;

/// Judges slices of one size, spacing and orientation; at least one. One slice is a volume as thick as it says.
SliceStack stack_slices(std::vector<DicomSlice> slices, const SliceName& name);

/// Why a stack is no volume, for people; empty where it is. untilt: whether a tilt is no reason, nor are uneven steps
/// of tilted slices that leave no hole.
std::string why_no_volume(const SliceStack& stack, bool untilt);

}  // namespace birdseye::host
