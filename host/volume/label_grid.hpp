#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

struct LabelsOnGrid {
  Volume volume;                   ///< 0 where they do not reach
  std::vector<std::string> notes;  ///< what its reader should know, a line each, which names the file
};

/// Labels as their file has them, on the grid of the CT. path: for errors, which are Errc::bad_value: their voxels are
/// not the CT's, or most of those with a label lie outside of it; or both say whose they are, and labels are of
/// another patient, another frame of reference or another series.
Result<LabelsOnGrid> labels_on_grid(const Volume& ct, const ImageFile& labels, const std::filesystem::path& path);

}  // namespace birdseye::host
