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
#include "hw-sim/world/frame_camera.hpp"
#include "hw-sim/world/truth_files.hpp"

namespace birdseye::hw_sim {

namespace {

/// The flock: scope, pointer, and the reference where there is one. Before zero_ns is set, and until then, the world
/// stands still.
TrackerScript tracker_of(const CartSettings& settings, const World& world, std::vector<Fault> faults,
                         const std::atomic<std::int64_t>& zero_ns) {
  TrackerSettings tracker;
  tracker.unit.birds = world.reference() == ReferenceOn::nothing ? 2 : 3;
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
    if (bird == 2) {
      const auto reference = world.tracker_from_reference(world_s);
      return {reference.rotation(), reference.translation()};
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
  const auto world = World::create(*truth, liver->surface, lens, settings.seed, settings.pace, &cavity.organ,
                                   Happenings(faults.world), settings.reference);
  if (!world) return world.error();
  const auto laparoscope = Laparoscope::create({.lens = lens, .seed = settings.seed});
  if (!laparoscope) return laparoscope.error();
  (*laparoscope)->set_cavity(cavity);
  (*laparoscope)->set_bench(world->board());

  const Eigen::Vector3d tumour_mm = deformation->map->deformed_of(truth->tumour_centre_mm);
  if (auto written = write_truth(settings.folder, *world, {lens, settings.rate_hz, settings.deformation, tumour_mm});
      !written)
    return written.error();

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
  FaultTimeline befalling(faults.world, FaultTarget::world);
  befalling.begin(zero_ns);
  const auto tell = [&befalling] {
    befalling.advance(device_now().ns);
    for (const FaultEvent& event : befalling.take_events()) announce(event);
  };
  for (const Stage& stage : world->stages()) {
    const std::int64_t begins_ns = zero_ns + static_cast<std::int64_t>(stage.begins_s * 1e9);
    while (!stop && device_now().ns < begins_ns) {
      tell();
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
