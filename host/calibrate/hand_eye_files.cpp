#include "host/calibrate/hand_eye_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/base/median.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/hand_eye/pose_streams.hpp"
#include "host/calibrate/hand_eye_pictures.hpp"
#include "host/calibrate/station_poses.hpp"
#include "host/calibrate/time_hint.hpp"
#include "host/files/pose_collector.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;

/// Stations whose poses are missing are told, and left out.
Result<void> add_poses(const HandEyeFiles& files, std::vector<HandEyeStation>& stations, const char* what,
                       std::vector<std::string>& notes) {
  const auto sensor = poses_of_stations(files.poses, files.of_sensor, stations, "the sensor", what, notes);
  if (!sensor) return sensor.error();
  const bool moves = !files.board_poses.empty();
  std::vector<std::optional<TimedPose>> board(stations.size());
  if (moves) {
    auto read = poses_of_stations(files.board_poses, files.of_board, stations, "the board", what, notes);
    if (!read) return read.error();
    board = *std::move(read);
  }
  std::vector<HandEyeStation> kept;
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const auto& pose = (*sensor)[i];
    if (!pose || (moves && !board[i])) {
      notes.push_back(stations[i].name + ": there is no pose that could be used");
      continue;
    }
    stations[i].tracker_from_sensor = pose->tracker_from_sensor;
    if (moves) {
      stations[i].tracker_from_body =
          Transform<Tracker, TrackedBody>::from_matrix(board[i]->tracker_from_sensor.matrix());
    }
    kept.push_back(std::move(stations[i]));
  }
  stations = std::move(kept);
  return {};
}

Transform<Camera, Marker> view_of(const TimedPose& eye) {
  return Transform<Marker, Camera>::from_matrix(eye.tracker_from_sensor.matrix()).inverse();
}

void tell_by_kind(const std::string& of_what, const std::vector<std::string>& rejected,
                  std::vector<std::string>& notes) {
  for (const std::string& line : by_kind(rejected)) notes.push_back(of_what + line);
}

/// Whether a point of the world lies ahead (+1) or behind (-1) nearly all of the eyes, by less than 60 degrees.
bool nearly_all_have(const Eigen::Vector3d& point_mm, double side, const std::vector<HandEyeStation>& stations) {
  constexpr double kCosine = 0.5, kNearlyAll = 0.9;
  const auto count = std::ranges::count_if(stations, [&](const HandEyeStation& s) {
    const Eigen::Vector3d seen = *s.camera_from_marker * point_mm;
    return side * seen.z() > kCosine * seen.norm();
  });
  return static_cast<double>(count) >= kNearlyAll * static_cast<double>(stations.size());
}

/// Whether eyes look away from what they seem to look at: their axes meet at a place that nearly all have behind them,
/// as they have the world's origin. How far it is from them. Where only one of the two is so, what is tracked may be no
/// camera.
std::optional<double> look_away_mm(const std::vector<HandEyeStation>& stations) {
  constexpr double kHardlyMeet = 0.01;  // the axes' directions differ by some six degrees
  if (!nearly_all_have(Eigen::Vector3d::Zero(), -1, stations)) return std::nullopt;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const HandEyeStation& s : stations) {
    const auto marker_from_camera = s.camera_from_marker->inverse();
    const Eigen::Vector3d axis = marker_from_camera.rotation().col(2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    right += across * marker_from_camera.translation();
  }
  const auto count = static_cast<double>(stations.size());
  if (!(symmetric_eigenvalues(Eigen::Matrix3d(normal / count))[0] > kHardlyMeet)) return std::nullopt;
  const Eigen::Vector3d meet_mm = solve_symmetric(normal, right);
  if (!nearly_all_have(meet_mm, -1, stations)) return std::nullopt;
  std::vector<double> behind_mm;
  behind_mm.reserve(stations.size());
  for (const HandEyeStation& s : stations) behind_mm.push_back((*s.camera_from_marker * meet_mm).norm());
  return median_of(std::move(behind_mm));
}

/// Moves the board's origin to where hand-eye is to be judged.
void judge_at(const std::optional<Eigen::Vector3d>& asked_mm, HandEyeRecording& out) {
  auto& stations = out.input.stations;
  if (stations.empty()) return;
  if (!asked_mm) out.look_away_mm = look_away_mm(stations);
  if (!asked_mm && nearly_all_have(Eigen::Vector3d::Zero(), 1, stations)) return;
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

Result<HandEyeRecording> read_streams(const HandEyeFiles& files, const PoseSet& sensor, const PoseSet& eye) {
  std::vector<calibration::StampedSensor> sensors;
  for (const TimedPose& pose : sensor.poses) sensors.push_back({pose.time_s, pose.tracker_from_sensor});
  std::vector<calibration::StampedView> views;
  for (const TimedPose& pose : eye.poses) views.push_back({pose.time_s, view_of(pose)});
  auto paired = calibration::pair_pose_streams(sensors, views);
  if (!paired) {
    const TimedFile of_sensor{files.poses.string(), "--time-unit", sensor, files.of_sensor.s_per_unit.value_or(1)};
    const TimedFile of_eye{files.eye_poses.string(), "--eye-time-unit", eye, files.of_eye.s_per_unit.value_or(1)};
    const std::string hint = hint_on_time_units(of_sensor, of_eye);
    if (hint.empty()) return paired.error();
    return Error{Errc::bad_value, hint};
  }
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
    if (auto two = refuse_alike(files.poses, *sensor, files.eye_poses, *eye); !two) return two.error();
    if (sensor->timed) return read_streams(files, *sensor, *eye);
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
