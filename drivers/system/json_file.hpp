#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "calibration/base/result.hpp"

namespace birdseye {

/// A file of JSON, all of it, by read_whole_file(). Errc::bad_format, by its path: it is none, or nests deeper than
/// any.
Result<nlohmann::json> read_json_file(const std::filesystem::path& path);

/// In place of the words of nlohmann::json::exception, which are for programmers.
constexpr const char* kPartMissing = "a part of it is missing, or is not of the kind that it should be";

}  // namespace birdseye
