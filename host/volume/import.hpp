#pragma once

#include <filesystem>
#include <stop_token>

#include "calibration/base/result.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Reads a CT: a folder of one DICOM series, one DICOM file (a volume of one slice), or a NIfTI, NRRD, MHA or MHD file.
/// Refuses, with the reason and the remedy in one line that names the path: what is missing, unreadable, cut short or
/// no image; folders of several series, or with a file that is no slice of it (texts and the like beside them are
/// passed over); slices that are doubled, missing, unevenly spaced or sheared by a tilted gantry; voxels that are not
/// finite or beyond 16 bits; images that are not three-dimensional. Ends by itself once stop is requested (read_image).
Result<Volume> import_volume(const std::filesystem::path& path, const std::stop_token& stop = {});

}  // namespace birdseye::host
