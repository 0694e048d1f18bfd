#include "host/calibrate/hand_eye_pictures.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "calibration/camera/camera_calibration.hpp"
#include "calibration/camera/stereo_calibration.hpp"
#include "calibration/detect/pattern.hpp"
#include "host/calibrate/hand_eye_stereo.hpp"
#include "host/calibrate/picture_views.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/name_order.hpp"

namespace birdseye::host {

namespace {

using calibration::HandEyeStation;
using calibration::Pattern;
using calibration::PatternView;

std::optional<calibration::BoardSymmetry> symmetry_of(const Pattern& pattern) {
  if (!pattern.half_turn_ambiguous && !pattern.quarter_turn_ambiguous) return std::nullopt;
  Eigen::Vector2d low = Eigen::Vector2d::Constant(1e300), high = -low;
  for (const Eigen::Vector3d& p : calibration::pattern_points_mm(pattern)) {
    low = low.cwiseMin(p.head<2>());
    high = high.cwiseMax(p.head<2>());
  }
  return calibration::BoardSymmetry{0.5 * (low + high), pattern.quarter_turn_ambiguous ? 4 : 2};
}

Result<CameraModel> read_lens(const HandEyeFiles& files, const PictureViews& pictures) {
  auto camera = read_camera(files.camera);
  if (camera && (camera->width_px != pictures.width_px || camera->height_px != pictures.height_px))
    return Error{Errc::bad_value,
                 fmt::format("{}: a camera of {}x{} for pictures of {}x{}", files.camera.string(), camera->width_px,
                             camera->height_px, pictures.width_px, pictures.height_px)};
  constexpr double kMost = 1.2;  // more than boards and grabbers make
  const double off = camera ? camera->fy_px / camera->fx_px / files.pixel_aspect : 1;
  if (files.pixel_aspect != 1 && !(off < kMost && off > 1 / kMost))
    return Error{Errc::bad_value,
                 fmt::format("{}: its fy is {:.3g} of fx, where --pixel-aspect says {:.3g}", files.camera.string(),
                             camera->fy_px / camera->fx_px, files.pixel_aspect)};
  return camera;
}

/// From the pictures themselves.
Result<void> calibrate_lens(const PictureViews& pictures, double pixel_aspect, HandEyeRecording& out) {
  calibration::CameraCalibrationSettings settings;
  settings.pixel_aspect = pixel_aspect;
  auto solved = calibration::calibrate_camera(pictures.used, pictures.width_px, pictures.height_px, settings);
  if (!solved) return solved.error();
  out.camera_verdict = calibration::judge_camera(*solved);
  out.notes.push_back(fmt::format("the lens is calibrated from the same pictures: {:.2f} px, focal length {:.1f} px",
                                  solved->rms_px, solved->camera.fx_px));
  out.lens = *std::move(solved);
  out.input.camera = out.lens->camera;
  out.input.camera_covariance = out.lens->covariance;
  return {};
}

Result<void> calibrate_lenses(const PictureViews& left_pictures, const std::vector<PatternView>& left,
                              const RightPictures& right, double pixel_aspect, HandEyeRecording& out) {
  calibration::CameraCalibrationSettings settings;
  settings.pixel_aspect = pixel_aspect;
  auto solved = calibration::calibrate_stereo(left, right.views, {left_pictures.width_px, left_pictures.height_px},
                                              {right.width_px, right.height_px}, settings);
  if (!solved) return solved.error();
  out.camera_verdict = calibration::judge_stereo(*solved);
  out.notes.push_back(fmt::format("both lenses are calibrated from the same pictures: {:.2f} px, {:.2f} mm apart",
                                  solved->rms_px, solved->baseline_mm));
  out.input.camera = solved->left.camera;
  out.input.camera_covariance = solved->left.covariance;
  out.input.right = calibration::StereoLens{solved->right.camera, solved->right_from_left};
  out.lens = std::move(solved->left);
  return {};
}

/// The left pictures' views in the order of their names, with those in which nothing was found.
std::vector<PatternView> every_view(const PictureViews& pictures) {
  std::vector<PatternView> views = pictures.used;
  for (const auto& rejected : pictures.rejected) views.emplace_back().name = rejected.name;
  std::stable_sort(views.begin(), views.end(),
                   [](const auto& a, const auto& b) { return before_by_number(a.name, b.name); });
  return views;
}

Result<void> find_lens(const HandEyeFiles& files, const PictureViews& pictures, const std::vector<PatternView>& left,
                       const std::optional<RightPictures>& right, HandEyeRecording& out) {
  if (files.camera.empty())
    return right ? calibrate_lenses(pictures, left, *right, files.pixel_aspect, out)
                 : calibrate_lens(pictures, files.pixel_aspect, out);
  const auto camera = read_lens(files, pictures);
  if (!camera) return camera.error();
  out.input.camera = *camera;
  const auto covariance = read_camera_covariance(files.camera);
  if (!covariance) return covariance.error();
  out.input.camera_covariance = *covariance;
  if (!*covariance)
    out.notes.push_back(fmt::format("{} does not tell how well the lens is known: hand-eye's sigma leaves it out",
                                    files.camera.string()));
  if (!right || !right->lens) return {};
  out.input.right = right->lens;
  return check_relation(files, out.input);
}

/// Points that are no numbers tell nothing of a view.
void drop_unsound_points(PictureViews& views) {
  for (PatternView& view : views.used) {
    const auto sound = [](const auto& p) { return p.allFinite(); };
    if (std::ranges::all_of(view.points_px, sound) && std::ranges::all_of(view.points_in_marker_mm, sound)) continue;
    views.rejected.push_back({view.name, "a point that is not finite"});
    view.points_px.clear();
  }
  std::erase_if(views.used, [](const PatternView& view) { return view.points_px.empty(); });
}

/// Of pictures, or of points that were found in them before. Without a size these are taken to be of the lens's.
Result<PictureViews> views_of(const HandEyeFiles& files, const std::optional<Pattern>& pattern) {
  if (files.points.empty()) return read_picture_views(*pattern, files.images, files.pixel_aspect);
  std::string size = files.size;
  if (size.empty() && !files.camera.empty()) {
    const auto camera = read_camera(files.camera);
    if (!camera) return camera.error();
    size = fmt::format("{}x{}", camera->width_px, camera->height_px);
  }
  auto views = read_found_views(files.points, size);
  if (views) drop_unsound_points(*views);
  return views;
}

Result<std::optional<Pattern>> pattern_of(const HandEyeFiles& files) {
  if (files.board.empty()) return std::optional<Pattern>();
  auto pattern = calibration::parse_pattern(files.board);
  if (!pattern) return pattern.error();
  return std::optional<Pattern>(*std::move(pattern));
}

}  // namespace

Result<void> read_hand_eye_pictures(const HandEyeFiles& files, HandEyeRecording& out) {
  const auto pattern = pattern_of(files);
  if (!pattern) return pattern.error();
  const auto pictures = views_of(files, *pattern);
  if (!pictures) return pictures.error();
  if (!pictures->note.empty()) out.notes.push_back(pictures->note);
  for (const auto& rejected : pictures->rejected) out.notes.push_back(rejected.name + ": " + rejected.reason);
  out.picture_files = pictures->files;
  out.round_field = pictures->round_field;
  const std::vector<PatternView> left = every_view(*pictures);
  std::optional<RightPictures> right;
  if (!files.right_images.empty() || !files.right_points.empty()) {
    auto read = read_right_pictures(files, *pattern, left, out.notes);
    if (!read) return read.error();
    right = *std::move(read);
  }
  for (std::size_t i = 0; i < left.size(); ++i) {
    HandEyeStation& s = out.input.stations.emplace_back();
    s.name = left[i].name;
    s.view = left[i];
    out.pictures.push_back(s.name);
    if (right && !right->views[i].points_px.empty()) s.right_view = right->views[i];
  }
  if (pictures->used.empty()) return {};  // the solver says that too few are left
  const auto found = find_lens(files, *pictures, left, right, out);
  if (!found && files.camera.empty() && found.error().code == Errc::degenerate) {
    out.camera_verdict = calibration::judge_no_camera(found.error());
    return {};
  }
  if (!found) return found.error();
  if (*pattern) out.input.symmetry = symmetry_of(**pattern);
  return {};
}

}  // namespace birdseye::host
