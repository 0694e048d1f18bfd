#include "host/app/calibrate/hand_eye_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/solve/camera_calibration.hpp"
#include "calibration/solve/pattern.hpp"
#include "host/app/calibrate/name_order.hpp"
#include "host/app/calibrate/picture_views.hpp"
#include "host/app/text_files.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;
using calibration::Pattern;

std::optional<calibration::BoardSymmetry> symmetry_of(const Pattern& pattern) {
  if (!pattern.half_turn_ambiguous && !pattern.quarter_turn_ambiguous) return std::nullopt;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const Eigen::Vector3d& p : calibration::pattern_points_mm(pattern)) {
    low = low.cwiseMin(p.head<2>());
    high = high.cwiseMax(p.head<2>());
  }
  return calibration::BoardSymmetry{0.5 * (low + high), pattern.quarter_turn_ambiguous ? 4 : 2};
}

Result<CameraModel> find_camera(const HandEyeFiles& files, const PictureViews& pictures, HandEyeRecording& out) {
  if (!files.camera.empty()) {
    auto camera = read_camera(files.camera);
    if (camera && (camera->width_px != pictures.width_px || camera->height_px != pictures.height_px))
      return Error{Errc::bad_value,
                   fmt::format("{}: a camera of {}x{} for pictures of {}x{}", files.camera.string(), camera->width_px,
                               camera->height_px, pictures.width_px, pictures.height_px)};
    return camera;
  }
  auto solved = calibration::calibrate_camera(pictures.used, pictures.width_px, pictures.height_px);
  if (!solved) return solved.error();
  out.camera_verdict = calibration::judge_camera(*solved);
  out.notes.push_back(fmt::format("the lens is calibrated from the same pictures: {:.2f} px, focal length {:.1f} px",
                                  solved->rms_px, solved->camera.fx_px));
  out.lens = *std::move(solved);
  return out.lens->camera;
}

}  // namespace

Result<void> read_hand_eye_pictures(const HandEyeFiles& files, HandEyeRecording& out) {
  const auto pattern = calibration::parse_pattern(files.board);
  if (!pattern) return pattern.error();
  const auto pictures = read_picture_views(*pattern, files.images);
  if (!pictures) return pictures.error();
  auto& stations = out.input.stations;
  for (const calibration::PatternView& view : pictures->used) {
    HandEyeStation s;
    s.name = view.name;
    s.view = view;
    stations.push_back(std::move(s));
  }
  for (const auto& rejected : pictures->rejected) {
    stations.emplace_back().name = rejected.name;
    out.notes.push_back(rejected.name + ": " + rejected.reason);
  }
  std::stable_sort(stations.begin(), stations.end(),
                   [](const auto& a, const auto& b) { return before_by_number(a.name, b.name); });
  if (pictures->used.empty()) return {};  // the solver says that too few are left
  const auto camera = find_camera(files, *pictures, out);
  if (!camera && files.camera.empty() && camera.error().code == Errc::degenerate) {
    out.camera_verdict = calibration::judge_no_camera(camera.error());
    return {};
  }
  if (!camera) return camera.error();
  out.input.camera = *camera;
  out.input.symmetry = symmetry_of(*pattern);
  return {};
}

}  // namespace birdseye::host
