#pragma once

#include <filesystem>

#include "calibration/base/result.hpp"

namespace birdseye {

/// Brings a file onto the disk, so that it is there whatever happens next.
Result<void> sync_file(const std::filesystem::path& path);
/// The same of the names in a folder: without it a machine that goes down may come up with a name's former file.
Result<void> sync_folder(const std::filesystem::path& folder);
/// Makes a folder, and those above it that are not there yet, and brings the name of each onto the disk. Nothing is
/// done where it is there.
Result<void> make_folder_durably(const std::filesystem::path& folder);
/// Puts a file that was written whole into the place of another, or of none: after a power cut there is the former one
/// or the whole new one.
Result<void> replace_durably(const std::filesystem::path& written, const std::filesystem::path& place);

}  // namespace birdseye
