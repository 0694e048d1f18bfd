#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <string_view>

#include "host/files/pose_files.hpp"

namespace birdseye::host {

/// Without the blanks before and after it.
std::string_view trimmed(std::string_view text);

/// A number, or what stands in its place, in words: "missing", "\"abc\" is no number".
struct ReadNumber {
  double value = 0;
  std::string problem;  ///< empty where value counts
};
ReadNumber read_number(std::string_view text);

/// A pose, or why it is none.
struct ReadPose {
  Transform<Tracker, Sensor> tracker_from_sensor;
  std::string problem;
  bool unmapped = false;                ///< the problem is that it lies where the field was not mapped
  std::optional<double> error_mm = {};  ///< as TimedPose has it
};
/// The problem of a matrix whose upper left block, or whose last row, is another.
inline constexpr std::string_view kNoRotation = "no rotation";
inline constexpr std::string_view kNoLastRow = "its last row is not 0 0 0 1";
/// matrix: 4x4, lengths in units of mm_per_unit.
ReadPose checked_pose(const Eigen::Matrix4d& matrix, double mm_per_unit);
/// quaternion: as recorded, of length one to 1e-3.
ReadPose checked_pose(const Eigen::Quaterniond& quaternion, const Eigen::Vector3d& position, double mm_per_unit);
/// Why a matrix that was read column by column, or row by row, is none: it is written the other way.
std::string written_other_way(bool column_major);
/// text: 16 numbers separated by blanks, row by row, or column by column.
ReadPose read_matrix(std::string_view text, double mm_per_unit, bool column_major = false);

/// As how.inverted turns it round, and as the map of the field corrects it, or the problem that it lies where the field
/// was not mapped. No map: as it is.
ReadPose corrected(ReadPose pose, const PoseReading& how);

/// reference_from_sensor, or which of both is not there. The reference takes the tracker's place.
ReadPose against(const ReadPose& sensor, const std::string& sensor_name, const ReadPose& reference,
                 const std::string& reference_name);

/// What was passed over, one line for each kind of reason: those that differ in numbers alone are of one kind. "line 7:
/// missing (and 12 more like it)".
std::vector<std::string> by_kind(const std::vector<std::string>& rejected);

/// Gathers what a reader finds, in the order in which it was recorded.
class PoseCollector {
 public:
  /// most_error_mm: poses that tell a larger error are rejected.
  explicit PoseCollector(bool timed, std::optional<double> most_error_mm = {}) : most_error_mm_(most_error_mm) {
    set_.timed = timed;
  }

  /// Keeps the pose, or names what is wrong with it.
  void add(const std::string& name, double time_s, double unfiltered_time_s, const ReadPose& pose,
           const std::string& picture = {});
  void reject(const std::string& name, const std::string& why);
  /// Keeps words on what is odd and harmless.
  void note(std::string words) { set_.notes.push_back(std::move(words)); }
  /// For files that number their poses: sets the number of the pose that is added or rejected next.
  void set_next_index(std::size_t index) { next_index_ = index; }
  /// All poses in the order of time. An error where path held no pose, or no errors and a most was given.
  Result<PoseSet> finish(const std::filesystem::path& path) &&;

 private:
  void sort_by_time();
  void note_repeated_poses();
  void note_unmapped_poses();
  void note_shared_times(std::size_t shared);
  void note_errors();
  PoseSet set_;
  std::optional<double> most_error_mm_;
  std::vector<double> errors_mm_;  ///< of all poses that tell one
  std::size_t next_index_ = 0, unmapped_ = 0;
};

}  // namespace birdseye::host
