#pragma once

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// What read_pose_set does where how.body names a rigid body: the file at path holds, row by row, where the body's
/// points were tracked, as x1,y1,z1,x2,.. or by the names that the body's points have. The pose of a row is the rigid
/// fit of the body's points to those that were seen (at least three, not on a line); its error is the fit's RMS. Rows
/// of which the error is over how.most_error_mm, or kMostBodyError_mm, are rejected. A body whose points are in another
/// order than the recording's, mirrored or of another size is an error that says so.
Result<PoseSet> read_body_poses(const std::filesystem::path& path, const PoseReading& how);

/// More is no body that was tracked well: optical trackers themselves refuse a tool from about there.
inline constexpr double kMostBodyError_mm = 2;

}  // namespace birdseye::host
