#include "host/calibrate/hand_eye_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "calibration/hand_eye/pose_streams.hpp"
#include "host/calibrate/hand_eye_pictures.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;

/// Poses by their place among all that were recorded.
struct PosesByPlace {
  std::map<std::size_t, TimedPose> poses;
  std::size_t count = 0;
};

Result<PosesByPlace> read_by_place(const std::filesystem::path& path, const std::string& transform, double mm_per_unit,
                                   std::vector<std::string>& notes) {
  auto set = read_pose_set(path, transform, mm_per_unit);
  if (!set) return set.error();
  PosesByPlace out;
  for (const TimedPose& pose : set->poses) {
    out.poses.emplace(pose.index, pose);
    out.count = std::max(out.count, pose.index + 1);
  }
  out.count = std::max(out.count, set->poses.size() + set->rejected.size());
  for (const std::string& rejected : set->rejected) notes.push_back(path.string() + ": " + rejected);
  return out;
}

Error count_error(const char* what, std::size_t count, std::size_t poses) {
  return {Errc::bad_value, fmt::format("{} {} and {} poses of the sensor: they pair one by one in the order of their "
                                       "names, so there must be as many",
                                       count, what, poses)};
}

/// Stations whose poses are missing are told, and left out.
Result<void> add_poses(const HandEyeFiles& files, std::vector<HandEyeStation>& stations, const char* what,
                       std::vector<std::string>& notes) {
  const auto sensor = read_by_place(files.poses, files.transform, files.mm_per_unit, notes);
  if (!sensor) return sensor.error();
  if (sensor->count != stations.size()) return count_error(what, stations.size(), sensor->count);
  PosesByPlace board;
  if (!files.board_poses.empty()) {
    auto read = read_by_place(files.board_poses, files.board_transform, files.mm_per_unit, notes);
    if (!read) return read.error();
    board = *std::move(read);
    if (board.count != sensor->count) return count_error("poses of the board", board.count, sensor->count);
  }
  std::vector<HandEyeStation> kept;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const auto pose = sensor->poses.find(i);
    const auto body = board.poses.find(i);
    if (pose == sensor->poses.end() || (!files.board_poses.empty() && body == board.poses.end())) {
      notes.push_back(stations[i].name + ": there is no pose that could be used");
      continue;
    }
    stations[i].tracker_from_sensor = pose->second.tracker_from_sensor;
    if (!files.board_poses.empty())
      stations[i].tracker_from_body =
          Transform<Tracker, TrackedBody>::from_matrix(body->second.tracker_from_sensor.matrix());
    kept.push_back(std::move(stations[i]));
  }
  stations = std::move(kept);
  return {};
}

Transform<Camera, Marker> view_of(const TimedPose& eye) {
  return Transform<Marker, Camera>::from_matrix(eye.tracker_from_sensor.matrix()).inverse();
}

Result<HandEyeRecording> read_streams(const PoseSet& sensor, const PoseSet& eye) {
  std::vector<calibration::StampedSensor> sensors;
  for (const TimedPose& pose : sensor.poses) sensors.push_back({pose.time_s, pose.tracker_from_sensor});
  std::vector<calibration::StampedView> views;
  for (const TimedPose& pose : eye.poses) views.push_back({pose.time_s, view_of(pose)});
  auto paired = calibration::pair_pose_streams(sensors, views);
  if (!paired) return paired.error();
  HandEyeRecording out;
  for (const std::string& rejected : sensor.rejected) out.notes.push_back("of the sensor: " + rejected);
  for (const std::string& rejected : eye.rejected) out.notes.push_back("of the camera: " + rejected);
  out.input.stations = std::move(paired->stations);
  out.input.estimate_time_offset = true;
  out.stream_offset_s = paired->offset_s;
  out.stream_correlation = paired->correlation;
  return out;
}

Result<HandEyeRecording> read_eye_poses(const HandEyeFiles& files) {
  auto eye = read_pose_set(files.eye_poses, {}, files.mm_per_unit);
  if (!eye) return eye.error();
  if (eye->timed && files.board_poses.empty()) {
    const auto sensor = read_pose_set(files.poses, files.transform, files.mm_per_unit);
    if (!sensor) return sensor.error();
    if (sensor->timed) return read_streams(*sensor, *eye);
  }
  HandEyeRecording out;
  for (const std::string& rejected : eye->rejected) out.notes.push_back("of the camera: " + rejected);
  std::size_t count = 0;
  for (const TimedPose& pose : eye->poses) {
    HandEyeStation s;
    s.name = pose.name;
    s.camera_from_marker = view_of(pose);
    for (; count < pose.index; ++count) out.input.stations.emplace_back().camera_from_marker.emplace();
    out.input.stations.push_back(std::move(s));
    ++count;
  }
  for (; count < eye->poses.size() + eye->rejected.size(); ++count)
    out.input.stations.emplace_back().camera_from_marker.emplace();
  if (const auto added = add_poses(files, out.input.stations, "poses of the camera", out.notes); !added)
    return added.error();
  std::erase_if(out.input.stations, [](const HandEyeStation& s) { return s.name.empty(); });
  return out;
}

}  // namespace

Result<HandEyeRecording> read_hand_eye_stations(const HandEyeFiles& files) {
  if (files.images.empty()) return read_eye_poses(files);
  HandEyeRecording out;
  if (const auto read = read_hand_eye_pictures(files, out); !read) return read.error();
  if (const auto added = add_poses(files, out.input.stations, "pictures", out.notes); !added) return added.error();
  return out;
}

}  // namespace birdseye::host
