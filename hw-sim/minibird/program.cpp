#include "hw-sim/minibird/program.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "drivers/system/clock.hpp"
#include "drivers/system/wait.hpp"
#include "hw-sim/faults/announce.hpp"
#include "hw-sim/minibird/motion.hpp"
#include "hw-sim/minibird/tracker_loop.hpp"

namespace birdseye::hw_sim {

namespace {

Result<std::unique_ptr<Endpoint>> open_endpoint(const MiniBirdProgram& program) {
  if (!program.tty.empty()) return open_terminal(program.tty);
  if (!program.tcp.empty()) return listen_tcp(program.tcp);
  return listen_unix(program.unix_socket);
}

nlohmann::json truth_of(const MiniBirdProgram& program, std::int64_t zero_ns, double rate_hz) {
  const Circle circle{.period_s = program.period_s};
  nlohmann::json truth{{"zero_monotonic_ns", zero_ns},
                       {"motion", program.motion},
                       {"rate_hz", rate_hz},
                       {"drift_ppm", program.tracker.drift_ppm},
                       {"delay_ms", program.tracker.delay_ms},
                       {"birds", program.tracker.unit.birds}};
  if (program.motion == "circle") {
    truth["period_s"] = circle.period_s;
    truth["centre_mm"] = {circle.centre_mm.x(), circle.centre_mm.y(), circle.centre_mm.z()};
    truth["radius_mm"] = circle.radius_mm;
    truth["phase_rad"] = circle.phase_rad;
  }
  if (program.motion == "pivot") {
    const PivotMotion pivot;
    const Eigen::Vector3d& tip = pivot.tip_in_sensor_mm;
    const Eigen::Vector3d& divot = pivot.pivot_in_tracker_mm;
    truth["tip_in_sensor_mm"] = {tip.x(), tip.y(), tip.z()};
    truth["pivot_in_tracker_mm"] = {divot.x(), divot.y(), divot.z()};
  }
  return truth;
}

}  // namespace

Result<void> run_minibird(const MiniBirdProgram& program, const std::atomic<bool>& stop) {
  auto endpoint = open_endpoint(program);
  if (!endpoint) return std::move(endpoint).error();
  const std::string name = (*endpoint)->name();
  const std::int64_t zero_ns = device_now().ns;
  const auto write_truth = [&program, zero_ns](double rate_hz) -> Result<void> {
    return program.truth.empty() ? Result<void>() : replace_json(program.truth, truth_of(program, zero_ns, rate_hz));
  };
  if (auto written = write_truth(program.tracker.unit.rate_hz); !written) return written;

  const BirdMotion motion = motion_named(program.motion, program.period_s, zero_ns);
  TrackerLoop::Listeners listeners;
  listeners.on_fault = [](const FaultEvent& event) { announce(event); };
  listeners.on_rate = [&write_truth](double rate_hz) { (void)write_truth(rate_hz); };
  listeners.on_violation = [](int count) {
    announce({{"event", "violation"}, {"what", "EXAMINE while records stream"}, {"count", count}});
  };
  const TrackerLoop loop(*std::move(endpoint), TrackerScript(program.tracker, motion, zero_ns), listeners);
  announce({{"event", "ready"}, {"tracker", name}});
  const std::int64_t end_ns = zero_ns + static_cast<std::int64_t>(program.seconds * 1e9);
  while (!stop && (program.seconds <= 0 || device_now().ns < end_ns)) {
    sleep_for(Duration::from_ms(20));
  }
  return {};
}

}  // namespace birdseye::hw_sim
