#include "hw-sim/case/registration_case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/case/case_files.hpp"
#include "hw-sim/case/landmarks.hpp"
#include "hw-sim/case/placed_instruments.hpp"
#include "hw-sim/case/subject.hpp"
#include "hw-sim/case/viewpoints.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "hw-sim/phantom/json_file.hpp"
#include "hw-sim/phantom/own_files.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

/// Everything of a case, before it is written.
struct MadeCase {
  Subject subject;
  DrawnDeformation deformation;
  CameraModel lens;
  std::vector<Transform<Camera, Patient>> views, stated_views;
  std::vector<TrueLandmark> landmarks;
  std::vector<Vector3d> touches_mm;
  std::vector<std::vector<std::uint8_t>> pictures;
  std::vector<std::uint8_t> lens_circle;
};

Result<Subject> subject_of(const CaseSettings& settings) {
  if (!settings.ct.empty()) return liver_subject(settings.ct, settings.labels, settings.liver_label, settings.seed);
  if (settings.phantom == "head") return head_subject(settings.seed);
  if (settings.phantom == "liver") return liver_subject(settings.seed);
  return Error{Errc::bad_value, fmt::format("--phantom {}: there are liver and head", settings.phantom)};
}

Result<void> check(const CaseSettings& settings) {
  const auto in = [](double value, double low, double high) { return value >= low && value <= high; };
  if (!in(settings.views, 1, 50)) return Error{Errc::bad_value, "--views: give 1 to 50"};
  if (!in(settings.deformation.amplitude_mm, 0, 100)) return Error{Errc::bad_value, "--amplitude-mm: give 0 to 100"};
  if (!in(settings.deformation.push_width_mm, 10, 200))
    return Error{Errc::bad_value, "--push-width-mm: give 10 to 200"};
  if (settings.distance_mm != 0 && !in(settings.distance_mm, 30, 400)) {
    return Error{Errc::bad_value, "--distance-mm: give 30 to 400, or 0 for what suits the organ"};
  }
  if (!in(settings.noise, 0, 20)) return Error{Errc::bad_value, "--noise: give 0 to 20 times the usual"};
  if (!in(settings.lamp_offset_mm, -100, 100)) return Error{Errc::bad_value, "--light-offset-mm: give -100 to 100"};
  if (!in(settings.texture, 0, 5)) return Error{Errc::bad_value, "--texture: give 0 to 5 times the usual"};
  if (!in(settings.wet, 0, 5)) return Error{Errc::bad_value, "--wet: give 0 to 5 times the usual"};
  if (!in(settings.blood, 0, 1)) return Error{Errc::bad_value, "--blood: give a share, 0 to 1"};
  if (!in(settings.instruments, 0, 3)) return Error{Errc::bad_value, "--instruments: give 0 to 3"};
  if (!in(settings.blur_px, 0, 20)) return Error{Errc::bad_value, "--blur-px: give 0 to 20"};
  if (!in(settings.touches, 0, 300)) return Error{Errc::bad_value, "--touches: give 0 to 300"};
  if (!in(settings.touch_noise_mm, 0.01, 20)) return Error{Errc::bad_value, "--touch-noise-mm: give 0.01 to 20"};
  const PoseError& pose = settings.pose_error;
  for (const auto& [option, value] : {std::pair{"--pose-noise-mm", pose.noise_mm},
                                      {"--pose-noise-deg", pose.noise_deg},
                                      {"--pose-offset-mm", pose.offset_mm},
                                      {"--pose-offset-deg", pose.offset_deg}}) {
    if (!in(value, 0, 30)) return Error{Errc::bad_value, fmt::format("{}: give 0 to 30", option)};
  }
  std::error_code ignored;
  for (const auto& path : {settings.ct, settings.labels}) {
    if (!path.empty() && !std::filesystem::exists(path, ignored))
      return Error{Errc::not_found, fmt::format("{}: no such file or folder", path.string())};
  }
  return {};
}

Result<MadeCase> make_case(const CaseSettings& settings) {
  auto subject = subject_of(settings);
  if (!subject) return subject.error();
  auto deformation = draw_deformation(*subject, settings.deformation, settings.seed);
  if (!deformation)
    return std::move(deformation)
        .error()
        .with_context(fmt::format("--amplitude-mm {:g}", settings.deformation.amplitude_mm));

  MadeCase out{.subject = *std::move(subject),
               .deformation = *std::move(deformation),
               .lens = {},
               .views = {},
               .stated_views = {},
               .landmarks = {},
               .touches_mm = {},
               .pictures = {},
               .lens_circle = {}};
  out.lens = laparoscope_lens(settings.width_px, settings.height_px);
  const double distance_mm = settings.distance_mm > 0 ? settings.distance_mm : out.subject.view_distance_mm;
  out.views = choose_viewpoints(out.subject, settings.views, distance_mm, settings.seed);
  out.stated_views =
      settings.pose_error.any() ? tracked_poses(out.views, settings.pose_error, settings.seed) : out.views;
  const auto scope = Laparoscope::create({.lens = out.lens,
                                          .seed = settings.seed,
                                          .lamp_in_camera_mm = {settings.lamp_offset_mm, 0, 0},
                                          .well_lit_mm = distance_mm,
                                          .noise = settings.noise,
                                          .blur_px = settings.blur_px});
  if (!scope) return scope.error();
  const TissueMap& map = *out.deformation.map;
  Cavity cavity;
  cavity.organ = deformed(out.subject.surface, map);
  cavity.rest_mm = out.subject.surface.vertices;
  cavity.coat = out.subject.coat;
  cavity.texture = settings.texture;
  cavity.wet = settings.wet;
  cavity.blood = settings.blood;
  if (settings.instruments > 0) {
    auto instruments = place_instruments(cavity.organ, out.subject.towards_scope, settings.instruments, settings.seed);
    if (!instruments) return instruments.error();
    cavity.instruments = *std::move(instruments);
  }
  if (!settings.plain_background) {
    cavity.wall_centre_mm = 0.5 * (map.low_mm() + map.high_mm());
    cavity.wall_radius_mm = 1.1 * distance_mm + 0.5 * (map.high_mm() - map.low_mm()).norm();
  }
  (*scope)->set_cavity(cavity);
  auto landmarks = choose_landmarks(out.subject, cavity.organ, map, **scope, out.views, settings.seed);
  if (!landmarks) return landmarks.error();
  out.landmarks = *std::move(landmarks);
  if (settings.touches > 0) {
    auto touches = choose_touches(out.subject, cavity.organ, map, **scope, out.views, settings.touches,
                                  settings.touch_noise_mm, settings.seed);
    if (!touches) return touches.error();
    out.touches_mm = *std::move(touches);
  }
  for (std::size_t i = 0; i < out.views.size(); ++i)
    out.pictures.push_back((*scope)->look_into_cavity(out.views[i], i));
  out.lens_circle = (*scope)->lens_circle();
  return out;
}

std::string case_toml(const CaseSettings& settings, const MadeCase& made) {
  // A registrar of patches knows how many points the truth has, where it is one.
  const BezierMap* const patch = made.deformation.patch;
  const std::string points = patch ? fmt::format("[{}]", fmt::join(patch->inner(), ", ")) : "\"auto\"";
  std::string toml = fmt::format(
      "# Written by birdseye-sim case --seed {}. Paths are relative to this file.\n"
      "[volume]\npath = \"ct.nii.gz\"\nlabel = \"segmentation.nii.gz\"\nlabel_values = [{}]\ntransfer = \"{}\"\n\n"
      "[model]\ncontrol_points = {}\nlevel = 3\noptimiser = \"geometry\"\n",
      settings.seed, fmt::join(made.subject.organ_labels, ", "), made.subject.transfer, points);
  for (std::size_t i = 0; i < made.views.size(); ++i) {
    toml += fmt::format(
        "\n[[view]]\nimage = \"view{0}.png\"\ncamera = \"camera.yaml\"\ncamera_from_patient = \"view{0}.txt\"\n"
        "mask = \"mask.png\"\n",
        i);
  }
  toml += fmt::format("\n[target]\nplace_mm = [{:.3f}]  # the tumour's centre\n",
                      fmt::join(made.subject.tumour_centre_mm, ", "));
  if (!made.touches_mm.empty()) toml += "\n[points]\npath = \"points.csv\"\n";
  toml += "\n[truth]\nlandmarks = \"truth/landmarks.csv\"\n";
  return patch ? toml + "control_points = \"truth/control_points.json\"\n" : toml;
}

nlohmann::json deformation_of(const DeformationSettings& settings, const DrawnDeformation& drawn) {
  nlohmann::json json;
  json["kind"] = settings.amplitude_mm == 0 ? std::string("none") : name_of(settings.kind);
  for (const DrawnNumber& number : drawn.numbers) {
    if (number.values.size() == 1) {
      json[number.name] = number.values.front();
    } else {
      json[number.name] = number.values;
    }
  }
  return json;
}

nlohmann::json truth_of(const CaseSettings& settings, const MadeCase& made) {
  nlohmann::json truth;
  truth["seed"] = settings.seed;
  truth["phantom"] = settings.ct.empty() ? settings.phantom : "ct";
  truth["frame"] = "patient LPS, mm";
  truth["deformation"] = deformation_of(settings.deformation, made.deformation);
  if (made.deformation.patch) truth["dof"] = 3 * made.deformation.patch->control_mm().size();
  truth["amplitude_mm"] = settings.deformation.amplitude_mm;
  truth["min_jacobian"] = made.deformation.map->least_determinant();
  truth["noise"] = settings.noise;
  truth["light_in_camera_mm"] = json_of(Vector3d(settings.lamp_offset_mm, 0, 0));
  truth["plain_background"] = settings.plain_background;
  truth["texture"] = settings.texture;
  truth["wet"] = settings.wet;
  truth["blood"] = settings.blood;
  truth["instruments"] = settings.instruments;
  truth["blur_px"] = settings.blur_px;
  truth["pose_noise_mm"] = settings.pose_error.noise_mm;
  truth["pose_noise_deg"] = settings.pose_error.noise_deg;
  truth["pose_offset_mm"] = settings.pose_error.offset_mm;
  truth["pose_offset_deg"] = settings.pose_error.offset_deg;
  truth["touches"] = settings.touches;
  truth["touch_noise_mm"] = settings.touch_noise_mm;
  truth["tumour_centre_mm"] = json_of(made.subject.tumour_centre_mm);
  double sum_mm = 0;
  double most_mm = 0;
  for (const TrueLandmark& landmark : made.landmarks) {
    const double moved_mm = (landmark.deformed_mm - landmark.rest_mm).norm();
    sum_mm += moved_mm;
    most_mm = std::max(most_mm, moved_mm);
  }
  truth["landmarks_moved_mm_mean"] = sum_mm / static_cast<double>(made.landmarks.size());
  truth["landmarks_moved_mm_max"] = most_mm;
  return truth;
}

OwnFiles own_files(const std::filesystem::path& folder) {
  return {folder,
          "birdseye-sim case",
          "birdseye-sim-case.json",
          {"truth"},
          R"((ct|segmentation)\.nii\.gz|camera\.yaml|mask\.png|view[0-9]+\.(png|txt)|points\.csv|case\.toml|)"
          R"(truth/(field\.mha|landmarks\.csv|truth\.json|control_points\.json|view[0-9]+\.txt))"};
}

/// What write_all() writes.
std::vector<std::string> names_of(const CaseSettings& settings, const MadeCase& made) {
  std::vector<std::string> names{"ct.nii.gz", "segmentation.nii.gz", "camera.yaml",      "mask.png",
                                 "case.toml", "truth/field.mha",     "truth/truth.json", "truth/landmarks.csv"};
  for (std::size_t i = 0; i < made.views.size(); ++i) {
    names.push_back(fmt::format("view{}.png", i));
    names.push_back(fmt::format("view{}.txt", i));
    if (settings.pose_error.any()) names.push_back(fmt::format("truth/view{}.txt", i));
  }
  if (made.deformation.patch) names.emplace_back("truth/control_points.json");
  if (!made.touches_mm.empty()) names.emplace_back("points.csv");
  return names;
}

Result<void> write_all(const CaseSettings& settings, const MadeCase& made) {
  const std::filesystem::path& folder = settings.folder;
  // Once more, for the case took a while to make.
  if (auto is_free = check_free(own_files(folder)); !is_free) return is_free;
  if (auto begun = begin_files(own_files(folder), names_of(settings, made)); !begun) return begun;
  std::vector<Result<void>> written(3);
  // Each is a file through one codec on one core.
  tbb::parallel_for(0, 3, [&](int file) {
    if (file == 0) written[0] = write_volume(folder / "ct.nii.gz", made.subject.grid, made.subject.hu);
    if (file == 1) written[1] = write_labels(folder / "segmentation.nii.gz", made.subject.grid, made.subject.labels);
    if (file == 2) written[2] = write_map_field(folder / "truth" / "field.mha", *made.deformation.map);
  });
  written.push_back(write_camera(folder / "camera.yaml", made.lens));
  written.push_back(write_picture(folder / "mask.png", made.lens_circle, made.lens));
  for (std::size_t i = 0; i < made.views.size(); ++i) {
    written.push_back(write_picture(folder / fmt::format("view{}.png", i), made.pictures[i], made.lens));
    written.push_back(write_pose(folder / fmt::format("view{}.txt", i), made.stated_views[i]));
    if (settings.pose_error.any())
      written.push_back(write_pose(folder / "truth" / fmt::format("view{}.txt", i), made.views[i]));
  }
  if (made.deformation.patch)
    written.push_back(write_control_points(folder / "truth" / "control_points.json", *made.deformation.patch));
  if (!made.touches_mm.empty())
    written.push_back(write_surface_points(folder / "points.csv", made.touches_mm, settings.touch_noise_mm));
  written.push_back(write_landmarks(folder / "truth" / "landmarks.csv", made.landmarks));
  written.push_back(write_json(folder / "truth" / "truth.json", truth_of(settings, made)));
  written.push_back(write_text(folder / "case.toml", case_toml(settings, made)));
  const auto failed = std::find_if(written.begin(), written.end(), [](const Result<void>& r) { return !r; });
  return failed == written.end() ? Result<void>() : *failed;
}

}  // namespace

Result<void> write_case(const CaseSettings& settings) {
  if (auto checked = check(settings); !checked) return checked;
  if (auto is_free = check_free(own_files(settings.folder)); !is_free) return is_free;
  const auto made = make_case(settings);
  if (!made) return made.error();
  return write_all(settings, *made);
}

}  // namespace birdseye::hw_sim
