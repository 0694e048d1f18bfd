#include "host/guide/guided_calibration.hpp"

#include <utility>
#include <vector>

#include "host/texts/texts.hpp"

namespace birdseye::host {

void find_lens(GuidedStations& stations, const calibration::CameraCalibrationSettings& settings) {
  std::vector<calibration::PatternView> views;
  views.reserve(stations.input.stations.size());
  for (const calibration::HandEyeStation& station : stations.input.stations) views.push_back(station.view);
  auto found = calibration::calibrate_camera(views, stations.width_px, stations.height_px, settings);
  stations.lens_fault = found ? "" : found.error().what;
  stations.lens.reset();
  stations.input.camera.reset();
  if (!found) return;
  stations.lens = *std::move(found);
  stations.input.camera = stations.lens->camera;
}

Result<GuidedCalibration> calibrate_guided(GuidedStations stations) {
  GuidedCalibration out;
  out.stations = std::move(stations);
  if (!out.stations.input.camera) {
    out.verdict.add(Grade::fail, words("guide_no_lens_found", out.stations.lens_fault), words("guide_no_lens_do"));
    return out;
  }
  auto solved = calibration::calibrate_hand_eye(out.stations.input);
  if (!solved) return solved.error();
  out.hand_eye = *std::move(solved);
  out.verdict = calibration::judge(out.hand_eye);
  if (const auto& lens = out.stations.lens) {
    const Verdict of_lens = calibration::judge_camera(*lens);
    for (const std::string& reason : of_lens.reasons) out.verdict.add(of_lens.grade, words("guide_of_lens", reason));
  }
  return out;
}

}  // namespace birdseye::host
