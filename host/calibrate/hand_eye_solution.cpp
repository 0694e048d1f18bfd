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

}  // namespace

Result<HandEyeFound> solve_hand_eye(HandEyeRecording& recording, const RodAngles& angles, bool by_eye_poses) {
  HandEyeFound out;
  if (recording.input.stations.empty() || (!by_eye_poses && !recording.input.camera)) {
    out.verdict = recording.camera_verdict;
    if (out.verdict.grade != Grade::fail)
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
  if (const Grade lens = recording.camera_verdict.grade; lens != Grade::pass) {
    out.verdict.add(lens, fmt::format("the lens, calibrated from the same pictures, is {} by itself", name_of(lens)),
                    "calibrate the lens from more pictures (birdseye calibrate camera) and give it as --camera");
  }
  return out;
}

}  // namespace birdseye::host
