#include "hw-sim/world/cart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/case/deformation.hpp"
#include "hw-sim/faults/announce.hpp"
#include "hw-sim/faults/fault_script.hpp"
#include "hw-sim/minibird/tracker_loop.hpp"
#include "hw-sim/phantom/json_file.hpp"
#include "hw-sim/world/frame_camera.hpp"

namespace birdseye::hw_sim {

namespace {

/// What an operator knows: the board, the pointer, how many markers there are, how long it takes.
nlohmann::json sheet_of(const World& world) {
  nlohmann::json sheet;
  sheet["board"] =
      fmt::format("chessboard:{}x{}:{:g}mm", world.board().columns, world.board().rows, world.board().square_mm);
  sheet["tip_in_sensor_mm"] = json_of(world.tip_in_pointer_mm());
  sheet["fiducials"] = world.truth().fiducials_mm.size();
  for (const Stage& stage : world.stages())
    sheet["stages"].push_back({{"name", stage.name}, {"begins_s", stage.begins_s}});
  return sheet;
}

nlohmann::json truth_of(const World& world, const DeformationSettings& settings, const DrawnDeformation& deformation,
                        const CameraModel& lens) {
  nlohmann::json truth;
  truth["deformation"] = {{"kind", name_of(settings.kind)}, {"amplitude_mm", settings.amplitude_mm}};
  truth["tumour_centre_in_patient_mm"] = json_of(world.truth().tumour_centre_mm);
  truth["tumour_centre_moved_to_mm"] = json_of(deformation.map->deformed_of(world.truth().tumour_centre_mm));
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
    const Eigen::Matrix4d m = (world.tracker_from_camera(world_s).inverse() * world.tracker_from_patient()).matrix();
    csv += fmt::format("{},{:.6f}", sequence, world_s);
    for (int i = 0; i < 16; ++i) csv += fmt::format(",{:.9g}", m(i / 4, i % 4));
    csv += '\n';
  }
  return csv;
}

/// The flock of two, scope and pointer. Before zero_ns is set, and until then, the world stands still.
TrackerScript tracker_of(const CartSettings& settings, const World& world, std::vector<Fault> faults,
                         const std::atomic<std::int64_t>& zero_ns) {
  TrackerSettings tracker;
  tracker.unit.birds = 2;
  tracker.noise = settings.noise;
  tracker.distortion_mm = settings.distortion_mm;
  tracker.seed = settings.seed;
  tracker.faults = std::move(faults);
  tracker.faults_from_streaming = false;
  const BirdMotion motion = [&world, &zero_ns](std::size_t bird, std::int64_t at_ns) -> BirdPose {
    const std::int64_t zero = zero_ns;
    const double world_s = zero == 0 ? 0 : std::max(0.0, static_cast<double>(at_ns - zero) * 1e-9);
    if (bird == 0) {
      const auto scope = world.tracker_from_sensor(world_s);
      return {scope.rotation(), scope.translation()};
    }
    const auto pointer = world.tracker_from_pointer(world_s);
    return {pointer.rotation(), pointer.translation()};
  };
  return TrackerScript(tracker, motion, device_now().ns);
}

}  // namespace

Result<void> run_cart(const CartSettings& settings, const std::atomic<bool>& stop) {
  const auto truth = read_phantom_truth(settings.phantom);
  if (!truth) return truth.error();
  FaultScript faults;
  if (!settings.faults.empty()) {
    auto script = read_fault_script(settings.faults, Instruments::both, settings.seed);
    if (!script) return script.error();
    faults = *std::move(script);
  }
  const auto liver = liver_shape(settings.phantom);
  if (!liver) return liver.error();
  const CameraModel lens = laparoscope_lens(settings.width_px, settings.height_px);
  const auto deformation = draw_deformation(*liver, settings.deformation, settings.seed);
  if (!deformation)
    return deformation.error().with_context(fmt::format("--deformation-mm {:g}", settings.deformation.amplitude_mm));
  Cavity cavity{.organ = liver->surface, .wall_centre_mm = truth->liver_centre_mm};
  if (settings.deformation.amplitude_mm > 0) {
    cavity.organ = deformed(liver->surface, *deformation->map);
    cavity.rest_mm = liver->surface.vertices;
  }
  const auto world = World::create(*truth, liver->surface, lens, settings.seed, settings.pace, &cavity.organ);
  if (!world) return world.error();
  const auto laparoscope = Laparoscope::create({.lens = lens, .seed = settings.seed});
  if (!laparoscope) return laparoscope.error();
  (*laparoscope)->set_cavity(cavity);
  (*laparoscope)->set_bench(world->board());

  std::error_code error;
  std::filesystem::create_directories(settings.folder / "truth", error);
  for (const Result<void>& written :
       {write_json(settings.folder / "truth" / "truth.json",
                   truth_of(*world, settings.deformation, *deformation, lens)),
        write_text(settings.folder / "truth" / "frames.csv", frames_csv(*world, settings.rate_hz)),
        write_json(settings.folder / "cart.json", sheet_of(*world))}) {
    if (!written) return written.error();
  }

  auto terminal = open_terminal(settings.tty);
  if (!terminal) return std::move(terminal).error();
  FrameCamera::Settings camera_settings;
  camera_settings.socket = settings.socket;
  camera_settings.lens = lens;
  camera_settings.rate_hz = settings.rate_hz;
  camera_settings.seed = settings.seed;
  camera_settings.delay_ms = settings.camera_delay_ms;
  camera_settings.drop_late = settings.drop_late;
  camera_settings.faults = std::move(faults.camera);
  const auto camera = FrameCamera::listen(camera_settings, *world, **laparoscope);
  if (!camera) return camera.error();
  std::atomic<std::int64_t> world_zero_ns = 0;
  TrackerLoop::Listeners listeners;
  listeners.on_fault = [](const FaultEvent& event) { announce(event); };
  TrackerLoop tracker(*std::move(terminal), tracker_of(settings, *world, std::move(faults.tracker), world_zero_ns),
                      listeners);
  announce({{"event", "ready"}});

  while (!stop && !(tracker.streaming() && (*camera)->ready())) sleep_for(Duration::from_ms(10));
  const std::int64_t zero_ns = device_now().ns + 1'000'000'000;
  world_zero_ns = zero_ns;
  tracker.align(zero_ns);
  (*camera)->start(zero_ns);
  for (const Stage& stage : world->stages()) {
    const std::int64_t begins_ns = zero_ns + static_cast<std::int64_t>(stage.begins_s * 1e9);
    while (!stop && device_now().ns < begins_ns) {
      sleep_until(std::min(Deadline(DeviceTime{begins_ns}), Deadline::after(Duration::from_ms(20))));
    }
    // The end is when the last frame is out, which a slow machine may see later than the script has it.
    const std::int64_t latest_ns = begins_ns + 30'000'000'000;
    while (!stop && stage.name == "end" && !(*camera)->done() && device_now().ns < latest_ns) {
      sleep_for(Duration::from_ms(20));
    }
    if (stop) return {};
    announce({{"event", "stage"}, {"name", stage.name}, {"world_s", stage.begins_s}, {"monotonic_ns", begins_ns}});
  }
  // The tracker goes on a little, so that whoever pairs the last frame has poses from after it.
  sleep_for(Duration::from_ms(500));
  return {};
}

}  // namespace birdseye::hw_sim
