#include "host/simulated/simulated_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "drivers/system/json_file.hpp"
#include "drivers/system/whole_file.hpp"

namespace birdseye::host {

namespace {

std::string spaced(std::string line) {
  std::replace(line.begin(), line.end(), ',', ' ');
  return line;
}

}  // namespace

std::optional<OverlayError> overlay_error(const SimulatedTruth& truth, std::uint64_t sequence,
                                          const CameraModel& camera,
                                          const Transform<Camera, Patient>& camera_from_patient,
                                          const Eigen::Vector3d& tumour_in_patient_mm) {
  const auto found = truth.frames.find(sequence);
  if (found == truth.frames.end()) return std::nullopt;
  const SimulatedTruth::Frame& frame = found->second;
  const Eigen::Vector3d true_mm = frame.camera_from_patient * frame.tumour_centre_in_patient_mm;
  const Eigen::Vector3d overlaid_mm = camera_from_patient * tumour_in_patient_mm;
  const auto true_px = project(frame.camera, true_mm);
  const auto overlaid_px = project(camera, overlaid_mm);
  OverlayError error;
  error.target_mm = (overlaid_mm - true_mm).norm();
  if (true_px && overlaid_px) {
    error.overlay_px = (*overlaid_px - *true_px).norm();
    error.true_and_overlaid_px = {*true_px, *overlaid_px};
  } else if (true_px || overlaid_px) {
    // One of the two lies behind the camera: as wrong as a picture can be.
    error.overlay_px = std::hypot(frame.camera.width_px, frame.camera.height_px);
  }
  return error;
}

Result<SimulatedTruth> read_simulated_truth(const std::filesystem::path& folder) {
  const auto wrong = [&](const char* name, const std::string& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", (folder / name).string(), why)};
  };
  SimulatedTruth::Frame first;
  try {
    const auto json = read_json_file(folder / "truth.json");
    if (!json) return json.error();
    const auto centre = json->at("tumour_centre_moved_to_mm").get<std::array<double, 3>>();
    first.tumour_centre_in_patient_mm = {centre[0], centre[1], centre[2]};
    const nlohmann::json& c = json->at("camera");
    CameraModel& camera = first.camera;
    c.at("width_px").get_to(camera.width_px);
    c.at("height_px").get_to(camera.height_px);
    for (const auto& [name, value] : {std::pair{"fx_px", &camera.fx_px},
                                      {"fy_px", &camera.fy_px},
                                      {"cx_px", &camera.cx_px},
                                      {"cy_px", &camera.cy_px},
                                      {"k1", &camera.k1},
                                      {"k2", &camera.k2},
                                      {"p1", &camera.p1},
                                      {"p2", &camera.p2},
                                      {"k3", &camera.k3}}) {
      c.at(name).get_to(*value);
    }
  } catch (const nlohmann::json::exception&) {
    return wrong("truth.json", kPartMissing);
  }
  SimulatedTruth truth;
  const auto frames = read_whole_file(folder / "frames.csv", kMostTextBytes);
  if (!frames) return frames.error();
  std::istringstream in(*frames);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream numbers(spaced(line));
    std::uint64_t sequence = 0;
    double world_s = 0;
    Eigen::Matrix4d m;
    numbers >> sequence >> world_s;
    for (int i = 0; i < 16; ++i) numbers >> m(i / 4, i % 4);
    if (!numbers) return wrong("frames.csv", "a row that is cut short");
    first.camera_from_patient = Transform<Camera, Patient>::from_matrix(m);
    truth.frames.emplace(sequence, first);
  }
  if (truth.frames.empty()) return wrong("frames.csv", "holds no frames");
  const auto scenes = read_whole_file(folder / "scene.csv", kMostTextBytes);
  if (!scenes) return scenes.error();
  std::istringstream scene(*scenes);
  std::getline(scene, line);
  std::size_t told = 0;
  for (; std::getline(scene, line); ++told) {
    std::istringstream numbers(spaced(line));
    std::uint64_t sequence = 0;
    double world_s = 0, fx_px = 0, fy_px = 0;
    Eigen::Vector3d tumour_mm;
    numbers >> sequence >> world_s >> tumour_mm.x() >> tumour_mm.y() >> tumour_mm.z() >> fx_px >> fy_px;
    const auto frame = truth.frames.find(sequence);
    if (!numbers || frame == truth.frames.end()) return wrong("scene.csv", "a row that is cut short or of no frame");
    frame->second.tumour_centre_in_patient_mm = tumour_mm;
    frame->second.camera.fx_px = fx_px;
    frame->second.camera.fy_px = fy_px;
  }
  if (told != truth.frames.size()) return wrong("scene.csv", "has not a row for each frame of frames.csv");
  return truth;
}

}  // namespace birdseye::host
