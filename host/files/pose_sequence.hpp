#pragma once

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// Whether the file is a PLUS sequence, by its name or its first bytes.
bool is_sequence(const std::filesystem::path& path);

/// What read_pose_set does for a PLUS sequence.
Result<PoseSet> read_sequence(const std::filesystem::path& path, const PoseReading& how);

}  // namespace birdseye::host
