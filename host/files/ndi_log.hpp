#pragma once

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// Whether the file is a log of tools as NDI's programs write it: a table, in whose first lines a header has the
/// columns Q0 and State (or TransformStatus).
bool is_ndi_log(const std::filesystem::path& path);

/// What read_pose_set does for such a log, which is in mm. Each tool's columns are its port or name, Frame, Face,
/// State, Q0,Qx,Qy,Qz,Tx,Ty,Tz,Error and, where they are there, a count of markers with State,Tx,Ty,Tz each. A row
/// holds all tools side by side, or one tool after the other down the file.
Result<PoseSet> read_ndi_log(const std::filesystem::path& path, const PoseReading& how);

}  // namespace birdseye::host
