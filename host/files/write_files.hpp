#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A file to write, and its text.
struct FileText {
  std::filesystem::path path;
  std::string text;
};

/// Writes all or none: first each to a temporary file beside its place and onto the disk, then all into their places,
/// so that a reader, or whoever starts the machine after a power cut, finds of each file the old one or the whole new
/// one. Pipes and devices are written to as they are. Empty paths are passed over.
Result<void> write_files(const std::vector<FileText>& files);
Result<void> write_file(const std::filesystem::path& path, const std::string& text);
/// Indented, with a final newline.
std::string text_of(const nlohmann::json& json);

}  // namespace birdseye::host
