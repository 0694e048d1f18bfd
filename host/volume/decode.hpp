#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "calibration/base/result.hpp"
#include "host/volume/image_file.hpp"

namespace birdseye::host {

/// Told each file's path before a decoder touches it.
using Announce = std::function<void(const std::filesystem::path&)>;

// Only read_image's copy of the process may call these: a decoder may end its process on a damaged file.
bool is_dicom(const std::filesystem::path& path);
Result<ImageFile> decode_dicom_folder(const std::filesystem::path& folder, const Announce& announce);
Result<ImageFile> decode_dicom_file(const std::filesystem::path& path, const Announce& announce);
Result<ImageFile> decode_image_file(const std::filesystem::path& path, int components);

/// The Error "path: why".
Error refused(Errc code, const std::filesystem::path& path, const std::string& why);

}  // namespace birdseye::host
