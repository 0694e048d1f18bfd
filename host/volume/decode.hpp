#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Told each file's path before a decoder touches it.
using Announce = std::function<void(const std::filesystem::path&)>;

/// The decoders may end the process on damaged files, so that only import_volume's copy of it calls these
/// (docs/decisions/0012-isolated-import.md). Errors as import_volume's.
bool is_dicom(const std::filesystem::path& path);
Result<Volume> decode_dicom_folder(const std::filesystem::path& folder, const Announce& announce);
Result<Volume> decode_dicom_file(const std::filesystem::path& path, const Announce& announce);
Result<Volume> decode_image_file(const std::filesystem::path& path, const Announce& announce);

/// The Error "path: why".
Error refused(Errc code, const std::filesystem::path& path, const std::string& why);

/// Appends the voxels of an image to hu; refuses those that are no Hounsfield units.
Result<void> append_voxels(const std::filesystem::path& path, const double* voxels, std::size_t count,
                           std::vector<std::int16_t>& hu);

}  // namespace birdseye::host
