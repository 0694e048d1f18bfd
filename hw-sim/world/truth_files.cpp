#include "hw-sim/world/truth_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <system_error>

#include "hw-sim/phantom/json_file.hpp"

namespace birdseye::hw_sim {

namespace {

/// What an operator knows: the board, the pointer, how many markers there are, how long it takes.
nlohmann::json sheet_of(const World& world) {
  nlohmann::json sheet;
  sheet["board"] =
      fmt::format("chessboard:{}x{}:{:g}mm", world.board().columns, world.board().rows, world.board().square_mm);
  sheet["tip_in_sensor_mm"] = json_of(world.tip_in_pointer_mm());
  sheet["fiducials"] = world.truth().fiducials_mm.size();
  if (world.reference() != ReferenceOn::nothing)
    sheet["reference_on"] = world.reference() == ReferenceOn::patient ? "patient" : "table";
  for (const Stage& stage : world.stages())
    sheet["stages"].push_back({{"name", stage.name}, {"begins_s", stage.begins_s}});
  return sheet;
}

nlohmann::json truth_of(const World& world, const TruthOfCart& cart) {
  const CameraModel& lens = cart.lens;
  nlohmann::json truth;
  truth["deformation"] = {{"kind", name_of(cart.deformation.kind)}, {"amplitude_mm", cart.deformation.amplitude_mm}};
  truth["tumour_centre_in_patient_mm"] = json_of(world.truth().tumour_centre_mm);
  truth["tumour_centre_moved_to_mm"] = json_of(cart.tumour_mm);
  for (const Eigen::Vector3d& f : world.truth().fiducials_mm) truth["fiducials_in_patient_mm"].push_back(json_of(f));
  truth["tracker_from_patient"] = json_of(world.tracker_from_patient().matrix());
  truth["tracker_from_marker"] = json_of(world.tracker_from_marker().matrix());
  truth["camera_from_sensor"] = json_of(world.camera_from_sensor().matrix());
  truth["tip_in_sensor_mm"] = json_of(world.tip_in_pointer_mm());
  truth["camera"] = {{"width_px", lens.width_px},
                     {"height_px", lens.height_px},
                     {"fx_px", lens.fx_px},
                     {"fy_px", lens.fy_px},
                     {"cx_px", lens.cx_px},
                     {"cy_px", lens.cy_px},
                     {"k1", lens.k1},
                     {"k2", lens.k2},
                     {"p1", lens.p1},
                     {"p2", lens.p2},
                     {"k3", lens.k3}};
  return truth;
}

std::string frames_csv(const World& world, double rate_hz) {
  std::string csv = "sequence,world_s";
  for (int i = 0; i < 16; ++i) csv += fmt::format(",camera_from_patient_{}{}", i / 4, i % 4);
  csv += '\n';
  const auto frames = static_cast<std::uint64_t>(std::ceil(world.ends_s() * rate_hz));
  for (std::uint64_t sequence = 0; sequence < frames; ++sequence) {
    const double world_s = static_cast<double>(sequence) / rate_hz;
    const Eigen::Matrix4d m =
        (world.tracker_from_camera(world_s).inverse() * world.tracker_from_patient(world_s)).matrix();
    csv += fmt::format("{},{:.6f}", sequence, world_s);
    for (int i = 0; i < 16; ++i) csv += fmt::format(",{:.9g}", m(i / 4, i % 4));
    csv += '\n';
  }
  return csv;
}

/// Of each frame: where the tumour's centre is in the patient, and how long the lens is.
std::string scene_csv(const World& world, const TruthOfCart& cart) {
  std::string csv = "sequence,world_s,tumour_x_mm,tumour_y_mm,tumour_z_mm,fx_px,fy_px\n";
  const auto frames = static_cast<std::uint64_t>(std::ceil(world.ends_s() * cart.rate_hz));
  for (std::uint64_t sequence = 0; sequence < frames; ++sequence) {
    const double world_s = static_cast<double>(sequence) / cart.rate_hz;
    const Eigen::Vector3d at_mm = cart.tumour_mm + world.organ(world_s).shift_mm;
    const double zoom = world.zoom(world_s);
    csv += fmt::format("{},{:.6f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", sequence, world_s, at_mm.x(), at_mm.y(),
                       at_mm.z(), zoom * cart.lens.fx_px, zoom * cart.lens.fy_px);
  }
  return csv;
}

}  // namespace

Result<void> write_truth(const std::filesystem::path& folder, const World& world, const TruthOfCart& truth) {
  std::error_code error;
  std::filesystem::create_directories(folder / "truth", error);
  for (const Result<void>& written : {write_json(folder / "truth" / "truth.json", truth_of(world, truth)),
                                      write_text(folder / "truth" / "frames.csv", frames_csv(world, truth.rate_hz)),
                                      write_text(folder / "truth" / "scene.csv", scene_csv(world, truth)),
                                      write_json(folder / "cart.json", sheet_of(world))}) {
    if (!written) return written.error();
  }
  return {};
}

}  // namespace birdseye::hw_sim
