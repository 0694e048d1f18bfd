#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include "drivers/system/interrupt.hpp"
#include "drivers/system/program.hpp"
#include "host/app/commands.hpp"
#include "host/app/ct_options.hpp"
#include "host/app/overlay_options.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/files_sha256.hpp"
#include "host/files/picture.hpp"
#include "host/files/text_files.hpp"
#include "host/files/write_files.hpp"
#include "host/operation/operation.hpp"
#include "host/operation/replay_hardware.hpp"
#include "host/operation/snapshot.hpp"
#include "host/overlay/margins.hpp"
#include "host/overlay/render_scene.hpp"
#include "host/overlay/undistortion.hpp"
#include "host/render/engine.hpp"
#include "host/texts/texts.hpp"
#include "host/window/show_scene.hpp"
#include "host/window/window.hpp"

namespace birdseye::host {

namespace {

/// As the lens took it; straight, the centre to scale; straight, the whole picture.
constexpr const char* kDisplays[] = {"distorted", "undistorted", "undistorted-whole"};

struct RenderOptions {
  VolumeSource volume;
  ShownChoice shown;
  OverlayLook look;  ///< but for its render settings
  std::filesystem::path operation, camera, pose, path, deformation, over, out, movie, json;
  std::string transfer = "abdomen", size = "900x900", engine = "cpu", display = kDisplays[0];
  double clip = 0.5;
  double step_mm = 0.7, seconds = 4;
  std::vector<double> clip_plane;
  bool window = false, accept_unsigned = false;
  int frames = 0;
};

/// Where it is seen from, and through what.
Result<void> look(RenderScene& scene, const RenderOptions& options, const std::optional<Operation>& operation) {
  const bool posed = !options.pose.empty() || !options.path.empty();
  if (options.camera.empty() && !posed) return look_from_the_front(scene, options.size, options.clip);
  if ((options.camera.empty() && !operation) || !posed) {
    return Error{
        Errc::bad_value,
        "--camera (or --operation) and --pose (or --path) go together; give both, or neither for a view of the "
        "whole volume"};
  }
  if (operation) {
    if (!operation->calibrated) {
      return Error{Errc::bad_value, fmt::format("--operation {}: has no calibration; give --camera in its place",
                                                options.operation.string())};
    }
    scene.camera = operation->calibrated->scope.camera();
  } else {
    auto camera = read_camera(options.camera);
    if (!camera) return camera.error();
    scene.camera = *camera;
  }
  if (!options.path.empty()) {
    auto path = read_path(options.path);
    if (!path) return path.error();
    scene.path = *std::move(path);
    scene.camera_from_patient = scene.path.front();
    return {};
  }
  auto pose = read_pose(options.pose);
  if (!pose) return pose.error();
  scene.camera_from_patient = Transform<Camera, Patient>::from_matrix(*pose);
  return {};
}

Result<Picture> behind_of(const CameraModel& camera, const std::filesystem::path& over) {
  if (over.empty()) {
    const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
    return Picture{camera.width_px, camera.height_px, std::vector<std::uint8_t>(3 * pixels)};
  }
  auto picture = read_picture(over);
  if (picture && (picture->width_px != camera.width_px || picture->height_px != camera.height_px)) {
    return Error{Errc::bad_value,
                 fmt::format("{}: is {}x{} where the view is {}x{}; give the --camera that took it, or its --size",
                             over.string(), picture->width_px, picture->height_px, camera.width_px, camera.height_px)};
  }
  return picture;
}

/// What the operation was calibrated with, and the picture taken with: as replay asks it of a recording. What nothing
/// tells, whoever gives the picture answers for, and is told for what.
Result<void> check_taken_with(const RenderOptions& options, const Operation& operation) {
  const CalibratedScope& calibrated = *operation.calibrated;
  const auto told = read_taken_with(options.over);
  if (!told) return told.error();
  const std::string of = "the operation's calibration";
  const ReplayHardware hardware({{of, calibrated.found_with, DependsOn::tracker_and_camera, ""}},
                                {told->tracker, told->camera}, false);
  const bool scope_told = !calibrated.scope_name.empty() && !told->scope.empty();
  std::string why = hardware.why_not();
  if (why.empty() && scope_told)
    why = calibration::misfit("scope", {{"name", calibrated.scope_name}}, {{"name", told->scope}}, of);
  if (!why.empty()) {
    return Error{
        Errc::bad_value,
        fmt::format("--over {}: {}; give the operation that was done with what took this picture (--operation)",
                    options.over.string(), why)};
  }
  if (hardware.unproven().empty() && scope_told) return {};
  std::string camera;
  for (const auto& [name, value] : calibrated.found_with.camera)
    camera += fmt::format("{}{} {}", camera.empty() ? " (" : ", ", name, value);
  if (!camera.empty()) camera += ")";
  print_line(fmt::format(
      "nothing tells whether {} was taken with the operation's scope and camera{}, and with --pose: that is as you say",
      options.over.string(), camera));
  return {};
}

/// Where lines are to be shown straight: the picture behind resampled, and a lens to draw with that bends none.
void straighten(RenderScene& scene, const std::string& display) {
  if (display == kDisplays[0]) return;
  const CameraModel straight =
      pinhole_for(scene.camera, display == kDisplays[1] ? Kept::centre_scale : Kept::every_pixel);
  scene.straighten.emplace(scene.camera, straight);
  scene.behind.rgb = scene.straighten->apply(scene.behind.rgb);
  scene.camera = straight;
}

/// One to draw over a picture by; a view of the CT alone is a report, whoever wrote the operation.
Result<Operation> operation_of(const RenderOptions& options) {
  if (options.over.empty()) return read_operation(options.operation);
  const auto authors = Authors::of_this_machine(options.accept_unsigned);
  if (!authors) return authors.error();
  auto operation = read_operation(options.operation, *authors);
  if (operation && !operation->doubt.empty()) {
    print_error("birdseye", fmt::format("--operation {}: {}", options.operation.string(),
                                        words("why_unsigned", words("unsigned_operation"), operation->doubt)));
  }
  return operation;
}

Result<RenderScene> scene_of(const RenderOptions& options) {
  RenderScene scene;
  std::optional<Operation> operation;
  if (!options.operation.empty()) {
    auto kept = operation_of(options);
    if (!kept) return kept.error();
    operation = *std::move(kept);
  }
  ShownChoice choice = options.shown;
  choice.summed = operation.has_value();
  auto volume = read_shown(options.volume, choice);
  if (!volume) return volume.error();
  print_notes(volume->notes);
  if (operation) {
    if (auto same = check_patient(*operation, volume->ct_sha256, volume->labels_sha256); !same)
      return same.error().with_context("--operation " + options.operation.string());
  }
  scene.volume = std::move(volume->volume);
  scene.margins = std::move(volume->margins);
  if (auto looked = look(scene, options, operation); !looked) return looked.error();
  auto behind = behind_of(scene.camera, options.over);
  if (!behind) return behind.error();
  scene.behind = *std::move(behind);
  if (operation && operation->calibrated && options.camera.empty() && !options.over.empty()) {
    if (auto fits = check_taken_with(options, *operation); !fits) return fits.error();
  }
  straighten(scene, options.display);
  scene.settings.step_mm = options.step_mm;
  if (!options.clip_plane.empty()) {
    const Eigen::Vector3d normal(options.clip_plane[0], options.clip_plane[1], options.clip_plane[2]);
    if (!(normal.norm() > 0) || !std::isfinite(normal.norm() + options.clip_plane[3]))
      return Error{Errc::bad_value, "--clip-plane: needs a direction that is not 0 0 0, and a finite distance"};
    scene.settings.clip = ClipPlane{normal.normalized(), options.clip_plane[3] / normal.norm()};
  }
  scene.film_s = options.seconds;
  if (operation && operation->deformed) scene.deformation = operation->deformed->field;
  if (options.deformation.empty()) {
    if (scene.margins && scene.deformation) scene.margins = deformed(*scene.margins, *scene.deformation);
    return scene;
  }
  if (*std::min_element(scene.volume.size.begin(), scene.volume.size.end()) < 2) {
    return Error{Errc::unsupported,
                 fmt::format("{}: a single slice cannot be deformed; give a volume", options.volume.path.string())};
  }
  if (auto same = check_against_sheet(options.deformation); !same) return same.error();
  auto field = read_field(options.deformation);
  if (!field) return field.error();
  if (auto covers = check_covers(*field, scene.volume); !covers)
    return covers.error().with_context(options.deformation.string());
  scene.deformation = *std::move(field);
  if (scene.margins) scene.margins = deformed(*scene.margins, *scene.deformation);
  return scene;
}

/// The colours of a PNG are not premultiplied.
std::string transparent_png_of(ImageRgba image) {
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const int alpha = image.rgba[i + 3];
    for (std::size_t c = 0; c < 3 && alpha > 0; ++c) {
      image.rgba[i + c] = static_cast<std::uint8_t>(std::min(255, (image.rgba[i + c] * 255 + alpha / 2) / alpha));
    }
  }
  return png_of(RgbaView{image.rgba, image.width_px, image.height_px});
}

Result<void> write_still(const RenderOptions& options, const RenderScene& scene, Engine& engine) {
  OverlayLook look = options.look;
  look.render = scene.settings;
  const PaintedStill painted = draw(engine, scene, scene.camera_from_patient, look);
  const ImageRgba& image = painted.volume;
  const double ms = painted.rendered_in.seconds() * 1e3;
  if (const std::string fault = engine.fault(); !fault.empty()) {
    return Error{Errc::io, fmt::format("{}: {}; use --engine cpu", engine.name(), fault)};
  }
  std::size_t covered = 0;
  for (std::size_t i = 3; i < image.rgba.size(); i += 4) covered += image.rgba[i] > 0 ? 1 : 0;
  const double coverage = static_cast<double>(covered) / (static_cast<double>(image.rgba.size()) / 4);
  const bool seen = covered > 0;
  const nlohmann::json json = {
      {"engine", engine.name()},
      {"width_px", image.width_px},
      {"height_px", image.height_px},
      {"display", options.display},
      {"camera_matrix",
       {{scene.camera.fx_px, 0, scene.camera.cx_px}, {0, scene.camera.fy_px, scene.camera.cy_px}, {0, 0, 1}}},
      {"render_ms", ms},
      {"coverage", coverage},
      {"verdict", seen ? "pass" : "marginal"},
      {"reasons", {seen ? words("verdict_in_view") : words("verdict_not_in_view")}}};
  const std::string png =
      options.over.empty() ? transparent_png_of(image) : png_of(RgbView{painted.rgb, image.width_px, image.height_px});
  if (!options.movie.empty()) {
    note_interrupts();  // so that the half film is removed
    if (auto filmed = film_scene(options.movie, scene, engine); !filmed) return filmed;
  }
  if (auto written = write_files({{options.out, png}, {options.json, text_of(json)}}); !written) return written;
  fmt::print("{}: {}x{}, {:.0f} % covered, {:.0f} ms ({})\n", options.out.string(), image.width_px, image.height_px,
             100 * coverage, ms, engine.name());
  if (!seen)
    fmt::print(stderr, "birdseye: nothing of the volume is seen: look at --transfer, --pose and the spacing\n");
  return {};
}

Result<void> render(const RenderOptions& options) {
  if (options.out.empty() && !options.window) {
    return Error{Errc::bad_value, "--out: is empty; name the PNG to write, or give --window"};
  }
  if (!std::isfinite(options.step_mm) || !std::isfinite(options.clip)) {
    return Error{Errc::bad_value, "--step-mm and --clip need finite numbers"};
  }
  const auto transfer = load_transfer_function(options.transfer);
  if (!transfer) return transfer.error();
  const auto scene = scene_of(options);
  if (!scene) return scene.error();
  std::unique_ptr<Window> window;  // outlives the engine that draws with it
  if (options.window) {
    auto opened = Window::open("Birdseye: " + options.volume.path.filename().string(), scene->camera.width_px,
                               scene->camera.height_px);
    if (!opened) return opened.error();
    window = *std::move(opened);
  }
  const auto engine = make_engine(options.engine, scene->volume, *transfer, {.window = window.get()});
  if (!engine) return engine.error();
  if (!(*engine)->choice().empty()) fmt::print(stderr, "{}\n", (*engine)->choice());
  if (scene->deformation) (*engine)->deform(*scene->deformation);
  if (!options.window) return write_still(options, *scene, **engine);
  const auto last = show_scene(*window, *scene, **engine, options.frames);
  if (!last) return last.error();
  if (options.out.empty()) return {};
  return write_file(options.out, png_of(last->view()));
}

}  // namespace

void add_render(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<RenderOptions>();
  CLI::App& command = *app.add_subcommand("render", "render a CT to a PNG");
  command.add_option("--volume", options->volume.path, "DICOM folder, NIfTI, NRRD, MHA or MHD")->required();
  CLI::Option* const camera = command.add_option(
      "--camera", options->camera, "lens (of OpenCV, ROS or Kalibr); without it a view that shows the whole volume");
  command
      .add_option("--display", options->display,
                  "distorted, as the lens took it (default), undistorted, the centre to scale, or undistorted-whole")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(kDisplays), std::end(kDisplays))))
      ->needs(camera);
  CLI::Option* const pose = command.add_option("--pose", options->pose, "camera_from_patient, a 4x4 matrix, mm");
  CLI::Option* const deformation = command.add_option("--deformation", options->deformation,
                                                      "ITK displacement field, LPS mm (.mha, .nrrd, .nii.gz)");
  command.add_option("--operation", options->operation, kOperationHelp)
      ->type_name("FOLDER|FILE")
      ->excludes(camera)
      ->excludes(deformation);
  CLI::Option* const over =
      command.add_option("--over", options->over, "picture of that lens to draw over, as a frame of its video");
  for (CLI::Option* const option : add_look_options(command, options->look)) option->needs(over);
  command
      .add_flag("--accept-unsigned", options->accept_unsigned,
                "use also an operation that is not signed, or signed by a machine that is not known here")
      ->needs(over);
  command.add_option("--out", options->out, "PNG to write; RGBA, or RGB with --over")->check(png_name);
  command.add_option("--transfer", options->transfer, "preset or JSON file (default abdomen)");
  command.add_option("--size", options->size, "WIDTHxHEIGHT of the view without a camera");
  command.add_option("--clip", options->clip, "share of the depth cut away in the view without a camera (default 0.5)")
      ->check(CLI::Range(0.0, 0.99));
  command
      .add_option("--clip-plane", options->clip_plane,
                  "X Y Z D: what has X x + Y y + Z z >= D is kept, patient frame, mm")
      ->expected(4);
  command.add_option("--step-mm", options->step_mm, "between samples along a ray")->check(CLI::Range(0.05, 20.0));
  command.add_option("--engine", options->engine, "auto, cpu, gl or slices (default cpu)")
      ->check(CLI::IsMember(engine_names()));
  CLI::Option* const movie = command.add_option("--movie", options->movie,
                                                "MP4 of the camera along --path, the deformation growing, or a swing");
  command
      .add_option("--path", options->path,
                  "folder of camera_from_patient matrices, or a file of 16 numbers a line: the film's key poses")
      ->needs(movie)
      ->excludes(pose);
  command.add_option("--seconds", options->seconds, "that the film lasts (default 4)")
      ->check(CLI::Range(0.1, 600.0))
      ->needs(movie);
  CLI::Option* const window =
      command.add_flag("--window", options->window, "show it; --out gets what the window showed last");
  command.add_option("--frames", options->frames, "close the window after so many pictures")
      ->check(CLI::Range(1, 1'000'000))
      ->needs(window);
  add_ct_options(command, options->volume);
  add_shown_options(command, options->shown);
  CLI::Option* const json = command.add_option("--json", options->json, "write the figures to this file");
  window->excludes(movie)->excludes(json);
  command.callback([options, &status] { status.take(render(*options)); });
}

}  // namespace birdseye::host
