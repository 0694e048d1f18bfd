#pragma once

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// What read_pose_set does for a table of text (CSV): see there.
Result<PoseSet> read_pose_table(const std::filesystem::path& path, const PoseReading& how);

}  // namespace birdseye::host
