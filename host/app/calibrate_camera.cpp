#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "calibration/detect/pattern.hpp"
#include "host/app/calibrate_commands.hpp"
#include "host/app/results.hpp"
#include "host/calibrate/camera_report.hpp"
#include "host/calibrate/picture_views.hpp"
#include "host/calibrate/view_pairs.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"

namespace birdseye::host {

namespace {

namespace fs = std::filesystem;
using namespace calibration;

struct CameraOptions {
  std::string board, model = "auto", size, pixel_aspect = "1";
  std::vector<fs::path> images, right_images;
  fs::path points, right_points;
  bool plain = false;
  std::optional<double> rod_angle_deg;
  fs::path right_out, right_from_left_out;
  ResultPaths paths;
};

/// One camera's views, from pictures or from points that were found before.
struct CameraInput {
  std::vector<PatternView> views;
  std::vector<RejectedView> rejected;  ///< pictures without a view
  int width_px = 0, height_px = 0;
  std::string note;             ///< how the pattern was read, where otherwise than told
  std::vector<fs::path> files;  ///< the pictures, for the report
  std::optional<RoundField> round_field;
};

CameraInput input_of_views(PictureViews views) {
  CameraInput out{std::move(views.used), {}, views.width_px, views.height_px, views.note, std::move(views.files),
                  views.round_field};
  for (const auto& [name, reason] : views.rejected) out.rejected.push_back({0, name, reason});
  return out;
}

Result<PictureViews> views_of(const CameraOptions& options, bool right, double pixel_aspect) {
  const fs::path& points = right ? options.right_points : options.points;
  if (!points.empty()) return read_found_views(points, options.size);
  if (options.board.empty()) return Error{Errc::bad_value, "--images: give --board too, as chessboard:14x10:3mm"};
  const auto pattern = parse_pattern(options.board);
  if (!pattern) return pattern.error();
  return read_picture_views(*pattern, right ? options.right_images : options.images, pixel_aspect);
}

Result<CameraInput> input_of(const CameraOptions& options, bool right, double pixel_aspect) {
  auto views = views_of(options, right, pixel_aspect);
  if (!views) return views.error();
  return input_of_views(*std::move(views));
}

Result<CameraCalibrationSettings> settings_of(const CameraOptions& options) {
  CameraCalibrationSettings settings;
  settings.robust = !options.plain;
  const auto aspect = parse_pixel_aspect(options.pixel_aspect);
  if (!aspect) return aspect.error();
  settings.pixel_aspect = *aspect;
  if (options.model == "auto") return settings;
  settings.model = lens_model_of(options.model);
  if (!settings.model) {
    std::string names = "auto";
    for (const LensModel model : kLensModels) names += fmt::format(", {}", name_of(model));
    return Error{Errc::bad_value, fmt::format("--model {}: give one of {}", options.model, names)};
  }
  return settings;
}

void tell_note(const CameraInput& input, Verdict& verdict) {
  if (!input.note.empty()) verdict.add(Grade::pass, input.note);
}

std::string lens_text(const CameraCalibration& found) {
  return camera_text(found.camera) + camera_covariance_text(found.covariance);
}

/// Views that determine no camera: a verdict with its reasons, not an error.
void finish_without(const CameraOptions& options, const Error& error, const CameraInput& input, CommandStatus& status) {
  Verdict verdict = judge_no_camera(error, input.rejected);
  tell_note(input, verdict);
  nlohmann::json json{{"views_used", 0},
                      {"views_rejected", rejected_json(input.rejected)},
                      {"image_width_px", input.width_px},
                      {"image_height_px", input.height_px}};
  finish_calibration(options.paths, {}, std::move(json), HtmlPage("Camera calibration"), verdict, status);
}

void finish_with(const CameraOptions& options, const CameraInput& input, const CameraCalibration& found,
                 nlohmann::json json, HtmlPage page, const Verdict& verdict, CommandStatus& status) {
  if (input.round_field) json["round_field_radius_px"] = input.round_field->radius_px;
  if (options.rod_angle_deg) json["rod_angle_deg"] = *options.rod_angle_deg;
  std::string made_from =
      fmt::format("{}, {} views", options.board.empty() ? options.points.string() : options.board, found.views.size());
  if (found.pixel_aspect != 1) {
    json["pixel_aspect"] = found.pixel_aspect;
    made_from += fmt::format(", pixel aspect {:.4g}", found.pixel_aspect);
  }
  const RecordEntry entry{made_from, [&](CalibrationRecord& record, const Provenance& provenance) {
                            enter_lens(record,
                                       {provenance, found.camera, name_of(found.model), found.covariance, found.rms_px,
                                        found.held_out_px, options.rod_angle_deg, input.round_field});
                          }};
  finish_calibration(options.paths, lens_text(found), std::move(json), std::move(page), verdict, status, entry);
}

void add_rejected(const CameraInput& input, CameraCalibration& found) {
  found.rejected.insert(found.rejected.begin(), input.rejected.begin(), input.rejected.end());
}

void calibrate_one(const CameraOptions& options, const CameraCalibrationSettings& settings, const CameraInput& input,
                   CommandStatus& status) {
  auto found = calibrate_camera(input.views, input.width_px, input.height_px, settings);
  if (!found && found.error().code == Errc::degenerate) return finish_without(options, found.error(), input, status);
  if (!found) return status.refuse(found.error());
  add_rejected(input, *found);
  HtmlPage page("Camera calibration");
  add_camera_to(page, *found, input.files);
  Verdict verdict = judge_camera(*found);
  tell_note(input, verdict);
  finish_with(options, input, *found, camera_json(*found), std::move(page), verdict, status);
}

/// All views, pictures in which nothing was found among them, that their partners may be told.
std::vector<PatternView> every_view(const CameraInput& input) {
  std::vector<PatternView> views = input.views;
  for (const RejectedView& rejected : input.rejected) views.emplace_back().name = rejected.name;
  return views;
}

/// What was rejected as a picture is not told a second time, as a view without points.
void tell_once(const CameraInput& input, CameraCalibration& found) {
  std::erase_if(found.rejected, [&](const RejectedView& view) {
    return std::any_of(input.rejected.begin(), input.rejected.end(),
                       [&](const RejectedView& picture) { return picture.name == view.name; });
  });
  add_rejected(input, found);
}

void calibrate_two(const CameraOptions& options, const CameraCalibrationSettings& settings, const CameraInput& left,
                   const CameraInput& right, CommandStatus& status) {
  const std::vector<PatternView> left_views = every_view(left);
  std::vector<PatternView> right_views = every_view(right);
  if (const auto sound = pair_by_name(left_views, right_views); !sound) return status.refuse(sound.error());
  auto found = calibrate_stereo(left_views, right_views, {left.width_px, left.height_px},
                                {right.width_px, right.height_px}, settings);
  if (!found && found.error().code == Errc::degenerate) return finish_without(options, found.error(), left, status);
  if (!found) return status.refuse(found.error());
  tell_once(left, found->left);
  tell_once(right, found->right);
  Verdict verdict = judge_stereo(*found);
  tell_note(left, verdict);
  HtmlPage page("Stereo camera calibration");
  page.table({{"pair", ""},
              {"baseline, mm", fmt::format("{:.3f}", found->baseline_mm)},
              {"pairs used", std::to_string(found->pairs.size())},
              {"rms of the joint fit, px", fmt::format("{:.3f}", found->rms_px)},
              {"held out, px", fmt::format("{:.3f}", found->held_out_px)},
              {"from the epipolar lines, rms px", fmt::format("{:.3f}", found->epipolar_rms_px)}});
  add_camera_to(page, found->left, left.files, "left camera: ");
  add_camera_to(page, found->right, right.files, "right camera: ");
  nlohmann::json json = camera_json(found->left);
  json["right"] = camera_json(found->right);
  json["stereo"] = stereo_json(*found);
  if (verdict.grade != Grade::fail) {
    const auto written = write_files({{options.right_out, lens_text(found->right)},
                                      {options.right_from_left_out, pose_text(found->right_from_left.matrix())}});
    if (!written) return status.refuse(written.error());
  } else {
    for (const auto& path : {options.right_out, options.right_from_left_out}) tell_not_written(path);
  }
  finish_with(options, left, found->left, std::move(json), std::move(page), verdict, status);
}

void run_camera(const CameraOptions& options, CommandStatus& status) {
  const auto settings = settings_of(options);
  if (!settings) return status.refuse(settings.error());
  if (options.points.empty() == options.images.empty())
    return status.refuse({Errc::bad_value, "give either --images or --points"});
  const auto left = input_of(options, false, settings->pixel_aspect);
  if (!left) return status.refuse(left.error());
  if (options.right_points.empty() && options.right_images.empty())
    return calibrate_one(options, *settings, *left, status);
  const auto right = input_of(options, true, settings->pixel_aspect);
  if (!right) return status.refuse(right.error());
  calibrate_two(options, *settings, *left, *right, status);
}

}  // namespace

void add_calibrate_camera(CLI::App& calibrate, CommandStatus& status) {
  CLI::App* command = calibrate.add_subcommand("camera", "focal length, centre and distortion, from views of a board");
  auto options = std::make_shared<CameraOptions>();
  command->add_option("--board", options->board, "as chessboard:14x10:3mm (inner corners)")->type_name("SPEC");
  command->add_option("--images", options->images, "pictures of the board, or folders of them")->type_name("PATH");
  command->add_option("--points", options->points, "a folder of points that were found before, in place of pictures")
      ->type_name("FOLDER");
  command->add_option("--size", options->size, "of the pictures that --points come from, as 1920x1080")
      ->type_name("WxH");
  command
      ->add_option("--right-images", options->right_images,
                   "the right camera's, which pair with the left one's by name")
      ->type_name("PATH");
  command->add_option("--right-points", options->right_points, "the right camera's points, likewise")
      ->type_name("FOLDER");
  command
      ->add_option("--model", options->model,
                   "auto, pinhole, radial1, radial2, radial2_tangential2 or radial3_tangential2")
      ->type_name("NAME");
  command
      ->add_option("--pixel-aspect", options->pixel_aspect,
                   "a pixel's width over its height: 0.5 (or 1:2) of field-squeezed video, as 1920x540")
      ->type_name("RATIO");
  command->add_flag("--plain", options->plain, "plain least squares: nothing that does not fit is left out");
  command
      ->add_option("--rod-angle-deg", options->rod_angle_deg,
                   "of an oblique scope: at what the rod stood against the camera head (kept with the result)")
      ->check(CLI::Range(-360.0, 360.0));
  command->add_option("--right-out", options->right_out, "the right camera, as --out")->type_name("FILE");
  command->add_option("--right-from-left-out", options->right_from_left_out, "4x4 matrix, left to right camera, mm")
      ->type_name("FILE");
  add_result_options(*command, options->paths, "the camera, as OpenCV's YAML");
  command->callback([options, &status] { run_camera(*options, status); });
}

}  // namespace birdseye::host
