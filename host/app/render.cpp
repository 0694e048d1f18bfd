#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>

#include "host/app/commands.hpp"
#include "host/app/film.hpp"
#include "host/app/picture.hpp"
#include "host/app/progress.hpp"
#include "host/app/text_files.hpp"
#include "host/app/write_files.hpp"
#include "host/render/engine.hpp"
#include "host/volume/import.hpp"
#include "host/volume/labels.hpp"

namespace birdseye::host {

namespace {

struct Options {
  std::filesystem::path volume, labels, camera, pose, deformation, out, movie, json;
  std::vector<int> keep;
  std::string transfer = "abdomen", size = "900x900", engine = "cpu";
  double clip = 0.5;
  double step_mm = 0.7;
};

struct View {
  CameraModel camera;
  Transform<Camera, Patient> camera_from_patient;
  std::optional<ClipPlane> clip;
};

/// The corners of the volume's box in the patient frame.
std::pair<Eigen::Vector3d, Eigen::Vector3d> bounds(const Volume& volume) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
  Eigen::Vector3d high = -low;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d voxel((corner & 1) * (volume.size[0] - 1), (corner >> 1 & 1) * (volume.size[1] - 1),
                                (corner >> 2) * (volume.size[2] - 1));
    const Eigen::Vector3d p = volume.patient_from_voxel * voxel;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return {low, high};
}

/// From in front of the patient, head up; of a scan thinner than half its height or width, from the feet as
/// radiologists look at a slice. The volume fills the picture; what lies before share `clip` of its depth is cut away.
Result<View> default_view(const Volume& volume, const Options& options) {
  View view;
  CameraModel& c = view.camera;
  int read = 0;
  if (std::sscanf(options.size.c_str(), "%dx%d%n", &c.width_px, &c.height_px, &read) != 2 ||
      static_cast<std::size_t>(read) != options.size.size() || c.width_px < 16 || c.height_px < 16 ||
      c.width_px > 8192 || c.height_px > 8192) {
    return Error{Errc::bad_value, fmt::format("--size {}: give WIDTHxHEIGHT of 16 to 8192 pixels", options.size)};
  }
  const auto [low, high] = bounds(volume);
  const Eigen::Vector3d extent = high - low;
  const bool thin = 2 * extent.z() < std::min(extent.x(), extent.y());
  const Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d down =
      thin ? Eigen::Vector3d(Eigen::Vector3d::UnitY()) : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d forward = right.cross(down);
  const double wide = extent.x();
  const double tall = extent.dot(down.cwiseAbs());
  const double deep = extent.dot(forward);
  const double distance = 2.5 * std::max(wide, tall);
  const Eigen::Vector3d middle = 0.5 * (low + high);
  const Eigen::Vector3d eye = middle - (0.5 * deep + distance) * forward;
  c.fx_px = c.fy_px = 0.96 * (distance + options.clip * deep) * std::min(c.width_px / wide, c.height_px / tall);
  c.cx_px = 0.5 * (c.width_px - 1);
  c.cy_px = 0.5 * (c.height_px - 1);
  Eigen::Matrix3d patient_from_camera;
  patient_from_camera << right, down, forward;
  view.camera_from_patient = Transform<Patient, Camera>(patient_from_camera, eye).inverse();
  if (options.clip > 0) view.clip = ClipPlane{forward, low.dot(forward) + options.clip * deep};
  return view;
}

Result<View> view_of(const Volume& volume, const Options& options) {
  if (options.camera.empty() && options.pose.empty()) return default_view(volume, options);
  if (options.camera.empty() || options.pose.empty()) {
    return Error{Errc::bad_value,
                 "--camera and --pose go together; give both, or neither for a view of the whole volume"};
  }
  View view;
  auto camera = read_camera(options.camera);
  if (!camera) return camera.error();
  auto pose = read_pose(options.pose);
  if (!pose) return pose.error();
  view.camera = *camera;
  view.camera_from_patient = Transform<Camera, Patient>::from_matrix(*pose);
  return view;
}

/// The CT, or of it what has one of the labels to keep.
Result<Volume> shown_of(const Options& options) {
  auto volume = import_volume(options.volume);
  if (!volume || options.labels.empty()) return volume;
  const auto labels = import_labels(options.labels, *volume);
  if (!labels) return labels.error();
  auto kept = keep_labels(*volume, *labels, options.keep);
  if (!kept) return Error{kept.error().code, fmt::format("{}: {}", options.labels.string(), kept.error().what)};
  return kept;
}

std::vector<std::uint8_t> over_black(const ImageRgba& image) {
  std::vector<std::uint8_t> rgb;
  rgb.reserve(image.rgba.size() / 4 * 3);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    rgb.insert(rgb.end(), image.rgba.begin() + static_cast<std::ptrdiff_t>(i),
               image.rgba.begin() + static_cast<std::ptrdiff_t>(i + 3));
  }
  return rgb;
}

/// With a deformation: it grows from nothing and goes back. Without: the camera swings about the middle of the volume.
Result<void> make_movie(const Options& options, const Volume& volume, const View& view, const RenderSettings& settings,
                        const DisplacementField* deformation, Engine& engine) {
  constexpr int kFrames = 100;
  constexpr double kRate_hz = 25, kSwing_rad = 0.6;
  auto film = Film::open(options.movie, view.camera.width_px, view.camera.height_px, kRate_hz);
  if (!film) return film.error();
  const auto [low, high] = bounds(volume);
  const Eigen::Vector3d middle = 0.5 * (low + high);
  Progress progress;
  for (int frame = 0; frame < kFrames; ++frame) {
    if (frame % 10 == 0) progress(fmt::format("frame {} of {}", frame, kFrames));
    const double phase = 2 * std::numbers::pi * frame / kFrames;
    Transform<Camera, Patient> camera_from_patient = view.camera_from_patient;
    if (deformation != nullptr) {
      DisplacementField part = *deformation;
      const auto share = static_cast<float>(0.5 - 0.5 * std::cos(phase));
      for (Eigen::Vector3f& u : part.displacement_mm) u *= share;
      engine.deform(part);
    } else {
      const Eigen::Vector3d down = view.camera_from_patient.rotation().transpose().col(1);
      const Eigen::Matrix3d turn = rotation_exp(kSwing_rad * std::sin(phase) * down);
      camera_from_patient =
          view.camera_from_patient * Transform<Patient, Patient>(turn, Eigen::Vector3d(middle - turn * middle));
    }
    if (auto added = film->add(over_black(engine.render(view.camera, camera_from_patient, settings))); !added)
      return added;
  }
  progress.keep(options.movie.string());
  return film->finish();
}

Result<void> render(const Options& options) {
  if (options.out.empty()) return Error{Errc::bad_value, "--out: is empty; name the PNG to write"};
  if (!std::isfinite(options.step_mm) || !std::isfinite(options.clip)) {
    return Error{Errc::bad_value, "--step-mm and --clip need finite numbers"};
  }
  const auto transfer = load_transfer_function(options.transfer);
  if (!transfer) return transfer.error();
  const auto volume = shown_of(options);
  if (!volume) return volume.error();
  const auto view = view_of(*volume, options);
  if (!view) return view.error();
  std::string why;
  const auto engine = make_engine(options.engine, *volume, *transfer, &why);
  if (!engine) return engine.error();
  if (!why.empty()) fmt::print(stderr, "{}\n", why);
  std::optional<DisplacementField> deformation;
  if (!options.deformation.empty()) {
    if (*std::min_element(volume->size.begin(), volume->size.end()) < 2) {
      return Error{Errc::unsupported,
                   fmt::format("{}: a single slice cannot be deformed; give a volume", options.volume.string())};
    }
    auto field = read_field(options.deformation);
    if (!field) return field.error();
    deformation = *std::move(field);
    (*engine)->deform(*deformation);
  }
  RenderSettings settings;
  settings.step_mm = options.step_mm;
  settings.clip = view->clip;
  const auto began = std::chrono::steady_clock::now();
  ImageRgba image = (*engine)->render(view->camera, view->camera_from_patient, settings);
  const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - began).count();
  if (const std::string fault = (*engine)->fault(); !fault.empty()) {
    return Error{Errc::io, fmt::format("{}: {}; use --engine cpu", (*engine)->name(), fault)};
  }
  std::size_t covered = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    const int alpha = image.rgba[i + 3];
    if (alpha > 0) ++covered;
    // A PNG's colours are not premultiplied.
    for (std::size_t c = 0; c < 3 && alpha > 0; ++c) {
      image.rgba[i + c] = static_cast<std::uint8_t>(std::min(255, (image.rgba[i + c] * 255 + alpha / 2) / alpha));
    }
  }
  const double coverage = static_cast<double>(covered) / (static_cast<double>(image.rgba.size()) / 4);
  const bool seen = covered > 0;
  const nlohmann::json json = {
      {"engine", (*engine)->name()},
      {"width_px", image.width_px},
      {"height_px", image.height_px},
      {"render_ms", ms},
      {"coverage", coverage},
      {"verdict", seen ? "pass" : "marginal"},
      {"reasons", {seen ? "the volume is in view" : "nothing of the volume is seen: look at --transfer and --pose"}}};
  const std::string png = png_of(image.rgba, image.width_px, image.height_px, 4);
  if (!options.movie.empty()) {
    auto filmed = make_movie(options, *volume, *view, settings, deformation ? &*deformation : nullptr, **engine);
    if (!filmed) return filmed;
  }
  if (auto written = write_files({{options.out, png}, {options.json, text_of(json)}}); !written) return written;
  fmt::print("{}: {}x{}, {:.0f} % covered, {:.0f} ms ({})\n", options.out.string(), image.width_px, image.height_px,
             100 * coverage, ms, (*engine)->name());
  return {};
}

}  // namespace

void add_render(CLI::App& app, CommandStatus& status) {
  const auto options = std::make_shared<Options>();
  CLI::App& command = *app.add_subcommand("render", "render a CT to a PNG");
  command.add_option("--volume", options->volume, "DICOM folder, NIfTI, NRRD, MHA or MHD")->required();
  command.add_option("--camera", options->camera, "lens, OpenCV YAML; without it a view that shows the whole volume");
  command.add_option("--pose", options->pose, "camera_from_patient, a 4x4 matrix, mm");
  command.add_option("--deformation", options->deformation, "ITK displacement field, LPS mm (.mha, .nrrd, .nii.gz)");
  command.add_option("--out", options->out, "PNG to write, RGBA")->required();
  command.add_option("--transfer", options->transfer, "preset or JSON file (default abdomen)");
  command.add_option("--size", options->size, "WIDTHxHEIGHT of the view without a camera");
  command.add_option("--clip", options->clip, "share of the depth cut away in the view without a camera (default 0.5)")
      ->check(CLI::Range(0.0, 0.99));
  command.add_option("--step-mm", options->step_mm, "between samples along a ray")->check(CLI::Range(0.05, 20.0));
  command.add_option("--engine", options->engine, "auto, cpu, gl or slices (default cpu)")
      ->check(CLI::IsMember(engine_names()));
  command.add_option("--movie", options->movie, "MP4 of the deformation growing, or of the camera swinging");
  CLI::Option* const labels = command.add_option("--labels", options->labels, "label volume on the CT's grid");
  CLI::Option* const keep = command.add_option("--keep", options->keep, "the labels to show")->delimiter(',');
  labels->needs(keep);
  keep->needs(labels);
  command.add_option("--json", options->json, "write the figures to this file");
  command.callback([options, &status] { status.take(render(*options)); });
}

}  // namespace birdseye::host
