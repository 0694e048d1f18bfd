#include "host/app/simulated_truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

namespace birdseye::host {

Result<SimulatedTruth> read_simulated_truth(const std::filesystem::path& folder) {
  const auto wrong = [&](const char* name, const std::string& why) {
    return Error{Errc::bad_format, fmt::format("{}: {}", (folder / name).string(), why)};
  };
  SimulatedTruth truth;
  try {
    std::ifstream in(folder / "truth.json");
    const nlohmann::json json = nlohmann::json::parse(in);
    const auto centre = json.at("tumour_centre_in_patient_mm").get<std::array<double, 3>>();
    truth.tumour_centre_in_patient_mm = {centre[0], centre[1], centre[2]};
    const nlohmann::json& c = json.at("camera");
    CameraModel& camera = truth.camera;
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
  } catch (const nlohmann::json::exception& problem) {
    return wrong("truth.json", problem.what());
  }
  std::ifstream in(folder / "frames.csv");
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream numbers(line);
    std::uint64_t sequence = 0;
    double world_s = 0;
    Eigen::Matrix4d m;
    numbers >> sequence >> world_s;
    for (int i = 0; i < 16; ++i) numbers >> m(i / 4, i % 4);
    if (!numbers) return wrong("frames.csv", "a row that is cut short");
    truth.camera_from_patient.emplace(sequence, Transform<Camera, Patient>::from_matrix(m));
  }
  if (truth.camera_from_patient.empty()) return wrong("frames.csv", "holds no frames");
  return truth;
}

}  // namespace birdseye::host
