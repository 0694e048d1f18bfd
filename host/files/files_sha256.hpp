#pragma once

#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// The SHA-256 of a file's bytes; of a folder, of its files' names and sums, in the order of the names.
Result<std::string> files_sha256(const std::filesystem::path& path);

/// Refuses a file that is not as the sheet beside it says (`result.json` of register views: "sha256" by name). What no
/// sheet tells of is its giver's own statement.
Result<void> check_against_sheet(const std::filesystem::path& path);

}  // namespace birdseye::host
