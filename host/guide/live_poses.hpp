#pragma once

#include <string>

#include "drivers/system/progress.hpp"
#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// One bird's poses from an appliance that runs, as they come, for so many seconds. bird: as the appliance names it.
/// Errors: no appliance, one that tells of no such bird (naming those that it has), or of no pose for five seconds.
Result<PoseSet> collect_poses(const std::string& server, const std::string& bird, double seconds, Progress& progress);

}  // namespace birdseye::host
