#include "host/calibrate/hand_eye_stereo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "calibration/base/median.hpp"
#include "host/calibrate/view_pairs.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;
using calibration::PatternView;
using calibration::StereoLens;

Result<StereoLens> read_stereo_lens(const HandEyeFiles& files, const PictureViews& pictures) {
  auto camera = read_camera(files.right_camera);
  if (!camera) return camera.error();
  if (camera->width_px != pictures.width_px || camera->height_px != pictures.height_px)
    return Error{Errc::bad_value,
                 fmt::format("{}: a camera of {}x{} for right pictures of {}x{}", files.right_camera.string(),
                             camera->width_px, camera->height_px, pictures.width_px, pictures.height_px)};
  const auto matrix = read_camera_relation(files.right_from_left);
  if (!matrix) return matrix.error();
  return StereoLens{*camera, Transform<RightCamera, Camera>::from_matrix(*matrix)};
}

/// Of each corner of the right picture, how far it is from where the left one's board puts it.
std::vector<double> distances_px(const StereoLens& right, const Transform<Camera, Marker>& board,
                                 const PatternView& seen) {
  std::vector<double> out;
  for (std::size_t i = 0; i < seen.points_px.size(); ++i) {
    const auto pixel = project(right.camera, right.right_from_camera * (board * seen.points_in_marker_mm[i]));
    out.push_back(pixel ? (*pixel - seen.points_px[i]).norm() : right.camera.width_px);
  }
  return out;
}

}  // namespace

Result<RightPictures> read_right_pictures(const HandEyeFiles& files, const std::optional<calibration::Pattern>& pattern,
                                          const std::vector<PatternView>& left, std::vector<std::string>& notes) {
  auto pictures = files.right_points.empty() ? read_picture_views(*pattern, files.right_images, files.pixel_aspect)
                                             : read_found_views(files.right_points, files.size);
  if (!pictures) return pictures.error();
  RightPictures out{std::move(pictures->used), pictures->width_px, pictures->height_px, std::nullopt};
  for (const auto& rejected : pictures->rejected) {
    out.views.emplace_back().name = rejected.name;
    notes.push_back(fmt::format("{} (right): {}", rejected.name, rejected.reason));
  }
  if (const auto paired = pair_by_name(left, out.views); !paired) return paired.error();
  if (files.right_camera.empty() || pictures->width_px == 0) return out;
  auto lens = read_stereo_lens(files, *pictures);
  if (!lens) return lens.error();
  out.lens = *std::move(lens);
  return out;
}

Result<void> check_relation(const HandEyeFiles& files, const calibration::HandEyeInput& input) {
  constexpr double kSigma_px = 1;
  constexpr double kMost = 0.01;  // of the picture's width; a board placed by one picture is off by a tenth of that
  std::vector<double> off_px;
  for (const HandEyeStation& station : input.stations) {
    if (!station.right_view) continue;
    const auto pose = calibration::find_view_pose({{&*input.camera, {}, &station.view}}, kSigma_px);
    if (!pose) continue;
    const auto distances = distances_px(*input.right, pose->camera_from_marker, *station.right_view);
    off_px.insert(off_px.end(), distances.begin(), distances.end());
  }
  if (off_px.empty()) return {};
  const double middle_px = median_of(std::move(off_px));
  if (middle_px <= kMost * input.right->camera.width_px) return {};
  return Error{Errc::bad_value,
               fmt::format("{}: it puts what the left pictures show {:.0f} px from where the right ones show it: give "
                           "right_from_left, mm, of these two cameras, and see that left and right are not exchanged",
                           files.right_from_left.string(), middle_px)};
}

}  // namespace birdseye::host
