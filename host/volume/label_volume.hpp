#pragma once

#include <vector>

#include "host/dicom/dicom_labels.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// A segmentation on the grid of a CT.
struct LabelVolume {
  Volume volume;                   ///< a value a voxel, 0 where nothing is
  std::vector<NamedLabel> names;   ///< of its labels; without names where its file gives none
  std::vector<std::string> notes;  ///< what its reader should know, a line each, which names the file
};

}  // namespace birdseye::host
