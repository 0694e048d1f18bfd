#pragma once

#include <filesystem>

#include "calibration/base/result.hpp"
#include "host/volume/image_file.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Labels as their file has them, on the grid of the CT: 0 where they do not reach. path: for errors, which are
/// Errc::bad_value: their voxels are not the CT's, or lie outside of it; or both say whose they are, and labels are of
/// another patient or another frame of reference.
Result<Volume> labels_on_grid(const Volume& ct, const ImageFile& labels, const std::filesystem::path& path);

}  // namespace birdseye::host
