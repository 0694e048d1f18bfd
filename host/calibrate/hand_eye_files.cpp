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

Result<PosesByPlace> read_by_place(const std::filesystem::path& path, const PoseReading& how,
                                   std::vector<std::string>& notes) {
  auto set = read_pose_set(path, how);
  if (!set) return set.error();
  PosesByPlace out;
  for (const TimedPose& pose : set->poses) {
    out.poses.emplace(pose.index, pose);
    out.count = std::max(out.count, pose.index + 1);
  }
  out.count = std::max(out.count, set->poses.size() + set->rejected.size());
  for (const auto* told : {&set->rejected, &set->notes}) {
    for (const std::string& words : *told) notes.push_back(path.string() + ": " + words);
  }
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
  const auto sensor = read_by_place(files.poses, files.of_sensor, notes);
  if (!sensor) return sensor.error();
  if (sensor->count != stations.size()) return count_error(what, stations.size(), sensor->count);
  PosesByPlace board;
  if (!files.board_poses.empty()) {
    auto read = read_by_place(files.board_poses, files.of_board, notes);
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

/// A line for each kind of reason: those that differ in numbers alone are of one kind.
void tell_by_kind(const std::string& of_what, const std::vector<std::string>& rejected,
                  std::vector<std::string>& notes) {
  struct Kind {
    std::string first;
    std::size_t count = 0;
  };
  std::map<std::string, Kind> kinds;
  for (const std::string& line : rejected) {
    std::string kind = line;
    std::erase_if(kind, [](unsigned char c) { return std::isdigit(c) != 0; });
    Kind& of_line = kinds[kind];
    if (of_line.count++ == 0) of_line.first = line;
  }
  for (const auto& [name, kind] : kinds) {
    notes.push_back(of_what + kind.first);
    if (kind.count > 1) notes.back() += fmt::format(" (and {} more like it)", kind.count - 1);
  }
}

/// Whether the world's origin is what a camera looks at: ahead of nearly all of the eyes, by less than 60 degrees.
bool look_at_origin(const std::vector<HandEyeStation>& stations) {
  constexpr double kCosine = 0.5, kNearlyAll = 0.9;
  const auto ahead = std::ranges::count_if(stations, [](const HandEyeStation& s) {
    const Eigen::Vector3d& origin = s.camera_from_marker->translation();
    return origin.z() > kCosine * origin.norm();
  });
  return static_cast<double>(ahead) >= kNearlyAll * static_cast<double>(stations.size());
}

/// Moves the board's origin to where hand-eye is to be judged.
void judge_at(const std::optional<Eigen::Vector3d>& asked_mm, HandEyeRecording& out) {
  auto& stations = out.input.stations;
  if (stations.empty() || (!asked_mm && look_at_origin(stations))) return;
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();
  for (const HandEyeStation& s : stations)
    middle_mm += s.camera_from_marker->inverse().translation() / static_cast<double>(stations.size());
  out.judged_at_mm = asked_mm.value_or(middle_mm);
  const Transform<Marker, Marker> shift(Eigen::Matrix3d::Identity(), out.judged_at_mm);
  for (HandEyeStation& s : stations) s.camera_from_marker = *s.camera_from_marker * shift;
  const Eigen::Vector3d& at = out.judged_at_mm;
  out.notes.push_back(fmt::format("judged at ({:.1f}, {:.1f}, {:.1f}) mm of the world of --eye-poses{}", at.x(), at.y(),
                                  at.z(),
                                  asked_mm ? ""
                                           : ", in the middle of those poses, which do not look at its "
                                             "origin (--at X,Y,Z judges elsewhere)"));
}

Result<HandEyeRecording> read_streams(const PoseSet& sensor, const PoseSet& eye) {
  std::vector<calibration::StampedSensor> sensors;
  for (const TimedPose& pose : sensor.poses) sensors.push_back({pose.time_s, pose.tracker_from_sensor});
  std::vector<calibration::StampedView> views;
  for (const TimedPose& pose : eye.poses) views.push_back({pose.time_s, view_of(pose)});
  auto paired = calibration::pair_pose_streams(sensors, views);
  if (!paired) return paired.error();
  HandEyeRecording out;
  tell_by_kind("of the sensor: ", sensor.rejected, out.notes);
  tell_by_kind("of the camera: ", eye.rejected, out.notes);
  for (const std::string& note : sensor.notes) out.notes.push_back("of the sensor: " + note);
  for (const std::string& note : eye.notes) out.notes.push_back("of the camera: " + note);
  out.input.stations = std::move(paired->stations);
  out.input.estimate_time_offset = true;
  out.stream_offset_s = paired->offset_s;
  out.stream_correlation = paired->correlation;
  return out;
}

Result<HandEyeRecording> read_eye_poses(const HandEyeFiles& files) {
  auto eye = read_pose_set(files.eye_poses, files.of_eye);
  if (!eye) return eye.error();
  if (eye->timed && files.board_poses.empty()) {
    const auto sensor = read_pose_set(files.poses, files.of_sensor);
    if (!sensor) return sensor.error();
    if (sensor->timed) return read_streams(*sensor, *eye);
  }
  HandEyeRecording out;
  tell_by_kind("of the camera: ", eye->rejected, out.notes);
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
  if (files.images.empty() && files.points.empty()) {
    auto recording = read_eye_poses(files);
    if (recording) judge_at(files.at_mm, *recording);
    return recording;
  }
  HandEyeRecording out;
  if (const auto read = read_hand_eye_pictures(files, out); !read) return read.error();
  if (const auto added = add_poses(files, out.input.stations, files.points.empty() ? "pictures" : "views", out.notes);
      !added)
    return added.error();
  return out;
}

}  // namespace birdseye::host
