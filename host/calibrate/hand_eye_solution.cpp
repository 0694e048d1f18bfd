#include "host/calibrate/hand_eye_solution.hpp"

#include <fmt/format.h>

#include <utility>

namespace birdseye::host {

namespace {

/// With a rod, recording keeps the stations of its reference angle, of which the result is.
Result<void> solve_rod(const RodAngles& angles, HandEyeRecording& recording, HandEyeFound& out) {
  auto rod = calibrate_rod(recording, angles);
  if (!rod) return rod.error();
  recording.input.stations = rod->at_reference().stations;
  out.result = rod->at_reference().result;
  out.verdict = rod->at_reference().verdict;
  judge_rod(*rod, out.verdict);
  recording.notes.push_back(
      fmt::format("camera_from_sensor holds with the rod at {:g} degrees", rod->at_reference().angle_deg));
  out.rod = *std::move(rod);
  return {};
}

constexpr double kLongest_mm = 500;  // of a laparoscope, from the sensor on its handle to the lens

/// Where both streams are inverted they fit as well as the right ones: what is found then is where the tracker lies in
/// the board's frame. What tells them apart is that a camera is near its sensor, and a tracker farther from the board.
void judge_directions(const HandEyeRecording& recording, const calibration::HandEyeResult& result, Verdict& verdict) {
  if (!result.solved || recording.directions_said || recording.input.stations.front().tracker_from_body) return;
  const double hand_eye_mm = result.camera_from_sensor.translation().norm();
  const double inverted_mm = (result.body_from_marker * Eigen::Vector3d(-recording.judged_at_mm)).norm();
  if (hand_eye_mm <= inverted_mm) return;
  verdict.add(
      hand_eye_mm > kLongest_mm ? Grade::fail : Grade::marginal,
      fmt::format("the camera would be {:.0f} mm from its sensor, and the board only {:.0f} mm from the tracker: "
                  "both streams of poses seem to be inverted",
                  hand_eye_mm, inverted_mm),
      fmt::format("if the camera is {:.0f} mm from its sensor, say the other way of both: --poses-are {} "
                  "--eye-poses-are {}; if it is {:.0f} mm, say both as they were read: --poses-are {} "
                  "--eye-poses-are {}",
                  inverted_mm, recording.input.sensor_inverted ? "tracker_from_sensor" : "sensor_from_tracker",
                  recording.input.eye_inverted ? "marker_from_camera" : "camera_from_marker", hand_eye_mm,
                  recording.input.sensor_inverted ? "sensor_from_tracker" : "tracker_from_sensor",
                  recording.input.eye_inverted ? "camera_from_marker" : "marker_from_camera"));
}

/// A scope that turns in a trocar has all its axes meet there too, behind the camera; no scope is as long as to have
/// the trocar so far behind.
void judge_look_away(double behind_mm, Verdict& verdict) {
  const bool far = behind_mm > kLongest_mm;
  verdict.add(far ? Grade::fail : Grade::marginal,
              fmt::format("nearly all poses of the camera look straight away from where their axes meet, {:.0f} mm "
                          "behind them: OpenGL's axes, or left-handed{}?",
                          behind_mm, far ? "" : ", or does the scope turn in a trocar there"),
              fmt::format("export poses of a camera that looks along its z axis, x to the right and y down (from "
                          "OpenGL, turn it by 180 degrees about x), in right-handed axes; if they are right{}, or are "
                          "no camera's, say where to judge: --at X,Y,Z",
                          far ? "" : ", of a scope in a trocar"));
}

}  // namespace

Result<HandEyeFound> solve_hand_eye(HandEyeRecording& recording, const RodAngles& angles, bool by_eye_poses) {
  HandEyeFound out;
  if (recording.input.stations.empty() || (!by_eye_poses && !recording.input.camera)) {
    out.verdict = recording.camera_verdict;
    // Where no lens was found for want of pictures of the board, that is what to see to.
    if (out.verdict.grade != Grade::fail || recording.input.stations.empty())
      out.verdict.add(Grade::fail, "no picture shows the board together with a pose",
                      "see that --board names the pattern in the pictures");
    return out;
  }
  if (!angles.empty()) {
    if (const auto solved = solve_rod(angles, recording, out); !solved) return solved.error();
  } else {
    auto solved = calibration::calibrate_hand_eye(recording.input);
    if (!solved) return solved.error();
    out.result = *std::move(solved);
    out.verdict = calibration::judge(out.result);
  }
  if (by_eye_poses) judge_directions(recording, out.result, out.verdict);
  if (recording.look_away_mm) judge_look_away(*recording.look_away_mm, out.verdict);
  if (const Grade lens = recording.camera_verdict.grade; lens != Grade::pass) {
    out.verdict.add(lens, fmt::format("the lens, calibrated from the same pictures, is {} by itself", name_of(lens)),
                    "calibrate the lens from more pictures (birdseye calibrate camera) and give it as --camera");
  }
  return out;
}

}  // namespace birdseye::host
