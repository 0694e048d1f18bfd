#include "hw-sim/world/tracker.hpp"

#include <array>

#include "calibration/base/units.hpp"
#include "drivers/io/monotonic.hpp"
#include "hw-sim/phantom/grid.hpp"

namespace birdseye::hw_sim {

namespace {

constexpr double kDelayMs = 7.5;  // of the unit, filters off
constexpr double kNsPerByte = 10 * 1e9 / 115200;

template <typename To, typename From>
BirdPose noisy(const Transform<To, From>& pose, const TrackerNoise& noise, std::uint64_t seed, std::uint64_t key) {
  const auto normal3 = [&](std::uint64_t first) {
    return Eigen::Vector3d(hashed_normal(seed, key + first), hashed_normal(seed, key + first + 1),
                           hashed_normal(seed, key + first + 2));
  };
  return {pose.rotation() * rotation_exp(noise.angle_deg * kRadPerDeg * normal3(3)),
          pose.translation() + noise.position_mm * normal3(0)};
}

}  // namespace

SimulatedTracker::SimulatedTracker(PseudoTerminal terminal, const World& world, const TrackerNoise& noise,
                                   std::uint64_t seed)
    : terminal_(std::move(terminal)), world_(world), noise_(noise), seed_(seed) {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

std::array<BirdPose, 2> SimulatedTracker::poses(double world_s, std::int64_t cycle) const {
  const auto key = static_cast<std::uint64_t>(cycle) * 16;
  return {noisy(world_.tracker_from_sensor(world_s), noise_, seed_ + 51, key),
          noisy(world_.tracker_from_pointer(world_s), noise_, seed_ + 51, key + 8)};
}

void SimulatedTracker::run(const std::stop_token& stop) {
  constexpr std::int64_t kListenEveryNs = 1'000'000;
  UnitSettings settings;
  settings.birds = 2;
  Unit unit(settings);
  bool started = false;
  std::int64_t cycle = -1'000'000;  // before the world starts; from 0 on, its measurements
  auto measured_ns = static_cast<double>(drivers::now().ns);
  while (!stop.stop_requested()) {
    const double period_ns = 1e9 / unit.rate_hz();
    measured_ns += period_ns;
    ++cycle;
    if (const std::int64_t zero = zero_ns_;
        zero != 0 && !started && measured_ns + 0.5 * period_ns > static_cast<double>(zero)) {
      started = true;
      measured_ns = static_cast<double>(zero);
      cycle = 0;
    }
    const double world_s = started ? static_cast<double>(cycle) / unit.rate_hz() : 0.0;
    const std::vector<std::uint8_t> bytes = unit.measure(poses(world_s, cycle));
    const auto due_ns =
        static_cast<std::int64_t>(measured_ns + kDelayMs * 1e6 + kNsPerByte * static_cast<double>(bytes.size()));
    for (std::int64_t now = drivers::now().ns; now < due_ns && !stop.stop_requested(); now = drivers::now().ns) {
      for (const std::uint8_t byte : terminal_.read()) {
        if (const auto reply = unit.receive(byte); !reply.empty()) terminal_.write(reply);
      }
      streaming_ = unit.streaming();
      drivers::sleep_until({std::min(due_ns, now + kListenEveryNs)});
    }
    if (!bytes.empty()) terminal_.write(bytes);
  }
}

}  // namespace birdseye::hw_sim
