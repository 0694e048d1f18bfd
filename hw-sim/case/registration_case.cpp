#include "hw-sim/case/registration_case.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "hw-sim/camera/laparoscope.hpp"
#include "hw-sim/case/case_files.hpp"
#include "hw-sim/case/landmarks.hpp"
#include "hw-sim/case/subject.hpp"
#include "hw-sim/case/tissue_map.hpp"
#include "hw-sim/case/viewpoints.hpp"
#include "hw-sim/phantom/image_files.hpp"
#include "hw-sim/phantom/json_file.hpp"

namespace birdseye::hw_sim {

namespace {

using Eigen::Vector3d;

/// Everything of a case, before it is written.
struct MadeCase {
  Subject subject;
  TissueMap map;
  CameraModel lens;
  std::vector<Transform<Camera, Patient>> views;
  std::vector<TrueLandmark> landmarks;
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
  if (!in(settings.amplitude_mm, 0, 100)) return Error{Errc::bad_value, "--amplitude-mm: give 0 to 100"};
  if (settings.distance_mm != 0 && !in(settings.distance_mm, 30, 400)) {
    return Error{Errc::bad_value, "--distance-mm: give 30 to 400, or 0 for what suits the organ"};
  }
  if (!in(settings.noise, 0, 20)) return Error{Errc::bad_value, "--noise: give 0 to 20 times the usual"};
  if (!in(settings.lamp_offset_mm, -100, 100)) return Error{Errc::bad_value, "--light-offset-mm: give -100 to 100"};
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
  const TissueMap still(subject->grid.origin_mm, subject->grid.last_mm(), settings.inner);
  auto map = TissueMap::random(still, settings.amplitude_mm, subject->surface.vertices, settings.seed);
  if (!map) return map.error();

  MadeCase out{.subject = *std::move(subject),
               .map = *std::move(map),
               .lens = {},
               .views = {},
               .landmarks = {},
               .pictures = {},
               .lens_circle = {}};
  out.lens = laparoscope_lens(settings.width_px, settings.height_px);
  const double distance_mm = settings.distance_mm > 0 ? settings.distance_mm : out.subject.view_distance_mm;
  out.views = choose_viewpoints(out.subject, settings.views, distance_mm, settings.seed);
  const auto scope = Laparoscope::create({.lens = out.lens,
                                          .seed = settings.seed,
                                          .lamp_in_camera_mm = {settings.lamp_offset_mm, 0, 0},
                                          .well_lit_mm = distance_mm,
                                          .noise = settings.noise});
  if (!scope) return scope.error();
  Cavity cavity;
  cavity.organ = deformed(out.subject.surface, out.map);
  cavity.rest_mm = out.subject.surface.vertices;
  cavity.coat = out.subject.coat;
  if (!settings.plain_background) {
    cavity.wall_centre_mm = 0.5 * (out.map.low_mm() + out.map.high_mm());
    cavity.wall_radius_mm = 1.1 * distance_mm + 0.5 * (out.map.high_mm() - out.map.low_mm()).norm();
  }
  (*scope)->set_cavity(cavity);
  auto landmarks = choose_landmarks(out.subject, cavity.organ, out.map, **scope, out.views, settings.seed);
  if (!landmarks) return landmarks.error();
  out.landmarks = *std::move(landmarks);
  for (std::size_t i = 0; i < out.views.size(); ++i)
    out.pictures.push_back((*scope)->look_into_cavity(out.views[i], i));
  out.lens_circle = (*scope)->lens_circle();
  return out;
}

std::string case_toml(const CaseSettings& settings, const MadeCase& made) {
  std::string toml = fmt::format(
      "# Written by birdseye-sim case --seed {}. Paths are relative to this file.\n"
      "[volume]\npath = \"ct.nii.gz\"\nlabel = \"segmentation.nii.gz\"\nlabel_values = [{}]\ntransfer = \"{}\"\n\n"
      "[model]\ncontrol_points = [{}]\nlevel = 3\noptimiser = \"gradient\"\n",
      settings.seed, fmt::join(made.subject.organ_labels, ", "), made.subject.transfer,
      fmt::join(settings.inner, ", "));
  for (std::size_t i = 0; i < made.views.size(); ++i) {
    toml += fmt::format(
        "\n[[view]]\nimage = \"view{0}.png\"\ncamera = \"camera.yaml\"\ncamera_from_patient = \"view{0}.txt\"\n"
        "mask = \"mask.png\"\n",
        i);
  }
  return toml + "\n[truth]\nlandmarks = \"truth/landmarks.csv\"\ncontrol_points = \"truth/control_points.json\"\n";
}

nlohmann::json truth_of(const CaseSettings& settings, const MadeCase& made) {
  nlohmann::json truth;
  truth["seed"] = settings.seed;
  truth["phantom"] = settings.ct.empty() ? settings.phantom : "ct";
  truth["frame"] = "patient LPS, mm";
  truth["dof"] = 3 * made.map.control_mm().size();
  truth["amplitude_mm"] = settings.amplitude_mm;
  truth["min_jacobian"] = made.map.least_determinant();
  truth["noise"] = settings.noise;
  truth["light_in_camera_mm"] = json_of(Vector3d(settings.lamp_offset_mm, 0, 0));
  truth["plain_background"] = settings.plain_background;
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

Result<void> write_all(const CaseSettings& settings, const MadeCase& made) {
  const std::filesystem::path& folder = settings.folder;
  std::error_code error;
  std::filesystem::create_directories(folder / "truth", error);
  if (error) return Error{Errc::unreadable, fmt::format("{}: cannot be made; choose another --out", folder.string())};
  std::vector<Result<void>> written(3);
  // Each is a file through one codec on one core.
  tbb::parallel_for(0, 3, [&](int file) {
    if (file == 0) written[0] = write_volume(folder / "ct.nii.gz", made.subject.grid, made.subject.hu);
    if (file == 1) written[1] = write_labels(folder / "segmentation.nii.gz", made.subject.grid, made.subject.labels);
    if (file == 2) written[2] = write_map_field(folder / "truth" / "field.mha", made.map);
  });
  written.push_back(write_camera(folder / "camera.yaml", made.lens));
  written.push_back(write_picture(folder / "mask.png", made.lens_circle, made.lens));
  for (std::size_t i = 0; i < made.views.size(); ++i) {
    written.push_back(write_picture(folder / fmt::format("view{}.png", i), made.pictures[i], made.lens));
    written.push_back(write_pose(folder / fmt::format("view{}.txt", i), made.views[i]));
  }
  written.push_back(write_control_points(folder / "truth" / "control_points.json", made.map));
  written.push_back(write_landmarks(folder / "truth" / "landmarks.csv", made.landmarks));
  written.push_back(write_json(folder / "truth" / "truth.json", truth_of(settings, made)));
  written.push_back(write_text(folder / "case.toml", case_toml(settings, made)));
  const auto failed = std::find_if(written.begin(), written.end(), [](const Result<void>& r) { return !r; });
  return failed == written.end() ? Result<void>() : *failed;
}

}  // namespace

Result<std::array<int, 3>> parse_dof(const std::string& text) {
  constexpr int kMost = TissueMap::kMostInner;
  std::array<int, 3> inner{};
  int read = 0;
  int dof = 0;
  if (std::sscanf(text.c_str(), "%dx%dx%d%n", inner.data(), &inner[1], &inner[2], &read) == 3 &&
      static_cast<std::size_t>(read) == text.size()) {
    if (*std::min_element(inner.begin(), inner.end()) >= 1 && *std::max_element(inner.begin(), inner.end()) <= kMost)
      return inner;
  } else if (std::sscanf(text.c_str(), "%d%n", &dof, &read) == 1 && static_cast<std::size_t>(read) == text.size()) {
    for (int n = 1; n <= kMost; ++n) {
      if (dof == 3 * n * n * n) return std::array<int, 3>{n, n, n};
    }
  }
  return Error{Errc::bad_value, fmt::format("--dof {}: give 3, 24, 81, 192, 375, 648 or 1029, or inner control points "
                                            "an axis, 1 to {}, as 3x3x3",
                                            text, kMost)};
}

Result<void> write_case(const CaseSettings& settings) {
  if (auto checked = check(settings); !checked) return checked;
  const auto made = make_case(settings);
  if (!made) return made.error();
  return write_all(settings, *made);
}

}  // namespace birdseye::hw_sim
