#pragma once

#include <cstddef>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "calibration/base/result.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye {

/// A file of JSON, all of it, by read_whole_file(). Errc::bad_format, by its path: it is none, or nests deeper than
/// any. Parsed, it takes up to forty times its bytes.
Result<nlohmann::json> read_json_file(const std::filesystem::path& path, std::size_t most_bytes = kMostTextBytes);

/// In place of the words of nlohmann::json::exception, which are for programmers.
constexpr const char* kPartMissing = "a part of it is missing, or is not of the kind that it should be";

}  // namespace birdseye
