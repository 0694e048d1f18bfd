#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
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
};
/// matrix: 4x4, lengths in units of mm_per_unit.
ReadPose checked_pose(const Eigen::Matrix4d& matrix, double mm_per_unit);
/// quaternion: as recorded, of length one to 1e-3.
ReadPose checked_pose(const Eigen::Quaterniond& quaternion, const Eigen::Vector3d& position, double mm_per_unit);
/// text: 16 numbers, row by row, separated by blanks.
ReadPose read_matrix(std::string_view text, double mm_per_unit);

/// Gathers what a reader finds, in the order in which it was recorded.
class PoseCollector {
 public:
  explicit PoseCollector(bool timed) { set_.timed = timed; }

  /// Keeps the pose, or names what is wrong with it.
  void add(const std::string& name, double time_s, double unfiltered_time_s, const ReadPose& pose);
  void reject(const std::string& name, const std::string& why);
  /// For files that number their poses: sets the number of the pose that is added or rejected next.
  void set_next_index(std::size_t index) { next_index_ = index; }
  /// All poses in the order of time. An error where path held no pose.
  Result<PoseSet> finish(const std::filesystem::path& path) &&;

 private:
  void sort_by_time();
  void note_repeated_poses();
  PoseSet set_;
  std::size_t next_index_ = 0;
};

}  // namespace birdseye::host
