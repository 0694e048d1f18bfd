#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/field_map.hpp"
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
  /// RMS, as the program that wrote the file or the fit of a body's points tells it.
  std::optional<double> error_mm = {};
  std::string picture = {};  ///< that was taken there, as a table's column names it
};

struct PoseSet {
  std::vector<TimedPose> poses;       ///< in the order of their times or names
  std::vector<std::string> rejected;  ///< what was passed over and why: "frame 8: INVALID", "line 12: not finite"
  std::vector<std::string> notes;     ///< what is odd and harmless here: stamps out of order, poses that repeat
  bool timed = false;                 ///< times are seconds of a clock, not counts
  /// The file itself says which way its poses go, by names such as StylusToTracker or because its format has one way.
  bool direction_known = false;
  std::string picture_column = {};  ///< of a table: which column names pictures; empty where none does
};

/// How poses are to be read.
struct PoseReading {
  /// Which of a sequence's transforms, as "StylusToTracker", of an NDI log's tools, or of the tools that a column of a
  /// table names; empty where there is one only. An error where the file holds no names.
  std::string transform = {};
  /// Of a sequence: the poses are taken against this other tracked one, as "ReferenceToTracker":
  /// reference_from_sensor = tracker_from_reference^-1 * tracker_from_sensor, frame by frame and only where both are
  /// sound. In TimedPose the reference then takes the tracker's place.
  std::string reference = {};
  double mm_per_unit = 1;  ///< 1000 for files in metres
  bool unit_said = false;  ///< somebody said it
  /// Corrects each pose as birdseyed does; what it does not map is rejected.
  std::optional<calibration::FieldMap> field = {};
  /// Poses of which the file, or the fit of a body, tells a larger error are rejected.
  std::optional<double> most_error_mm = {};
  /// The points of a rigid body in its own frame: the file of poses then holds where they were tracked, row by row.
  std::filesystem::path body = {};
  /// Of the times of a table whose header names no unit; empty: seconds, or what numbers too large for seconds must be.
  std::optional<double> s_per_unit = {};
  /// Matrices are written column by column, as of OpenGL and MATLAB.
  bool column_major = false;
  /// The file holds sensor_from_tracker: each pose is inverted.
  bool inverted = false;
  /// What stands before "tool" and "transform" in the options that name it, for messages: "board-" of --board-tool.
  std::string option_prefix = {};
};

/// Poses from any of: a folder of files with one pose each (its .txt files, or else its .csv files, in the order of
/// their names, numbers in them by value; each a 4x4 matrix, or a table of one row; names that are whole numbers of
/// nanoseconds since 1970 are times; the last part of the path may hold * and ?, as folder/device.*.txt), a table with
/// columns t,x,y,z,qx,qy,qz,qw (s, lengths, Hamilton; a header may give them another order, a time is not needed), a
/// PLUS sequence (.igs.mha, .mha, .nrrd), a session recording, an NDI log, or a table of a body's tracked points. Rows
/// that are invalid, missing, not finite, sentinels such as -3.697314E28, no rotation or that repeat a stamp are
/// rejected by name, never used; a file that yields no pose is an error. Rotations are passed on as recorded (to 1e-3).
Result<PoseSet> read_pose_set(const std::filesystem::path& path, const PoseReading& how = {});

/// Refuses two files whose poses are alike to the last digit: one was given in the other's place.
Result<void> refuse_alike(const std::filesystem::path& a, const PoseSet& of_a, const std::filesystem::path& b,
                          const PoseSet& of_b);

/// The time that a file's name tells: where it is a whole number of nanoseconds since 1970, of 16 digits or more.
std::optional<double> time_by_name(const std::filesystem::path& file);

}  // namespace birdseye::host
