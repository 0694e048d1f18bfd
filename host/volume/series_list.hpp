#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/series.hpp"
#include "host/volume/volume_source.hpp"

namespace birdseye::host {

/// What a folder of DICOM files, with what lies below it, holds.
struct SeriesList {
  std::vector<SeriesInfo> series;       ///< at least one
  std::vector<std::string> unreadable;  ///< files that are no DICOM, or are cut short: an error's text each
};

/// Whether the path is a folder, or a file that begins as DICOM does.
bool holds_dicom(const std::filesystem::path& path);

/// The series of a folder, or of a DICOM file; in a process of its own and with the errors of read_image.
Result<SeriesList> list_series(const VolumeSource& source);

}  // namespace birdseye::host
