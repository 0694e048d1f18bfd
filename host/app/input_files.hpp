#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace birdseye::host {

/// What a command that is given a path reads there: the file or folder, with a pattern those that match it, of
/// `camchain.yaml:cam1` the file, and of a header that names other files those that hold its voxels.
std::vector<std::filesystem::path> input_files(const std::string& given);

/// What the case of `register views` in a file names, and what that names in turn. None where the file is no case,
/// which read_case() tells of.
std::vector<std::filesystem::path> files_of_case(const std::filesystem::path& file);

}  // namespace birdseye::host
