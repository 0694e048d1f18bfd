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
/// one. It gets the old one's mode. Where one cannot be replaced, those that were are put back; where the disk lets no
/// hard link keep an old one, the error names it. Pipes, devices, and links in /dev and /proc are opened before and
/// written to last, as they are. Empty paths are passed over. Two that are the same file are refused before anything is
/// written.
Result<void> write_files(const std::vector<FileText>& files);
Result<void> write_file(const std::filesystem::path& path, const std::string& text);
/// Whether write_files() writes to it as it is, and does not replace it: a device, a pipe, or a link in /dev or /proc.
bool stays(const std::filesystem::path& path);
/// Whether two paths name the same file, or would if it were there, whichever way they are spelled.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);
/// Indented, with a final newline.
std::string text_of(const nlohmann::json& json);

}  // namespace birdseye::host
