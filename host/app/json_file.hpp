#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// Writes text to path by way of a temporary file beside it, so that a reader finds the old file or the whole new one.
Result<void> write_file(const std::filesystem::path& path, const std::string& text);
/// As write_file, indented, with a final newline.
Result<void> write_json(const std::filesystem::path& path, const nlohmann::json& json);

}  // namespace birdseye::host
