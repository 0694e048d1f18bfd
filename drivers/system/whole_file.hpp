#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"
#include "drivers/system/unique_fd.hpp"

namespace birdseye {

/// Opens a file to read it. Refuses what is none, by its path: a folder, and a pipe, a device or a socket, which could
/// keep whoever reads them waiting, or give bytes without end. Opening them does not wait either. Errc::not_found: it
/// is not there.
Result<UniqueFd> open_file(const std::filesystem::path& path);

/// All of a file, by open_file(). Errc::unsupported: it has more than most_bytes, which are not read.
Result<std::string> read_whole_file(const std::filesystem::path& path, std::size_t most_bytes);

/// As much as any text has that is read whole: a record, a sheet, a configuration, a list of points.
constexpr std::size_t kMostTextBytes = 64U << 20U;

}  // namespace birdseye
