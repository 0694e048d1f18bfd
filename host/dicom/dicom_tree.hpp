#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/dicom/dicom_file.hpp"

namespace birdseye::host {

/// Told each file's path before a decoder touches it.
using Announce = std::function<void(const std::filesystem::path&)>;

/// The headers of what lies in a folder and those below it, in the order of the paths.
struct DicomTree {
  std::vector<DicomFile> files;   ///< all that are DICOM, but directories of media
  std::vector<Error> unreadable;  ///< files that may have been slices; each error names its path
  std::vector<std::filesystem::path> unreadable_paths;
};

/// Errors: the folder cannot be listed, or holds too many files. Files whose names say that they are none of DICOM's
/// are not looked at; links to folders are not followed.
Result<DicomTree> read_dicom_tree(const std::filesystem::path& folder, const Announce& announce);

}  // namespace birdseye::host
