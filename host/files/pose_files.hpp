#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::host {

/// One pose of a file or folder of them.
struct TimedPose {
  std::string name;       ///< the file's, "line 7" or "frame 7", for messages
  std::size_t index = 0;  ///< its place among all poses of the file, from 0, counting rejected ones
  double time_s = 0;      ///< as recorded; a filtered stamp where the file holds such
  /// The stamp as the pose arrived, with its jitter, where the file holds that too; otherwise time_s.
  double unfiltered_time_s = 0;
  Transform<Tracker, Sensor> tracker_from_sensor;
};

struct PoseSet {
  std::vector<TimedPose> poses;       ///< in the order of their times or names
  std::vector<std::string> rejected;  ///< what was passed over and why: "frame 8: INVALID", "line 12: not finite"
  std::vector<std::string> notes;     ///< what is odd and harmless here: stamps out of order, poses that repeat
  bool timed = false;                 ///< times are seconds of a clock, not counts
};

/// Poses from any of: a folder of 4x4 text matrices (its .txt files in the order of their names, numbers in them by
/// value; names that are whole numbers of nanoseconds since 1970 are times; the last part of the path may hold a *, as
/// folder/device.*.txt), a CSV with columns t,x,y,z,qx,qy,qz,qw (s, lengths, Hamilton; a header may give them another
/// order), or a PLUS sequence (.igs.mha, .mha, .nrrd), of which `transform` names the one to read, as "StylusToTracker"
/// (may be left empty where there is one only). mm_per_unit: 1000 for files in metres. Rows that are invalid, missing,
/// not finite, sentinels such as -3.697314E28, no rotation or that repeat a stamp are rejected by name, never used; a
/// file that yields no pose is an error. Rotations are passed on as recorded (to 1e-3).
Result<PoseSet> read_pose_set(const std::filesystem::path& path, const std::string& transform = {},
                              double mm_per_unit = 1);

/// Reads from a PLUS sequence, frame by frame, the pose of one sensor against another tracked one:
/// reference_from_sensor = tracker_from_reference^-1 * tracker_from_sensor. In TimedPose the reference takes the place
/// of the tracker. A frame counts only where both poses are sound. reference: as "ReferenceToTracker".
Result<PoseSet> read_relative_pose_set(const std::filesystem::path& path, const std::string& transform,
                                       const std::string& reference, double mm_per_unit = 1);

}  // namespace birdseye::host
