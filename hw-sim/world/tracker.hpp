#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "hw-sim/minibird/pseudo_terminal.hpp"
#include "hw-sim/minibird/unit.hpp"
#include "hw-sim/world/world.hpp"

namespace birdseye::hw_sim {

struct TrackerNoise {
  double position_mm = 0;  ///< standard deviation per axis and record
  double angle_deg = 0;    ///< likewise, about each axis
};

/// A flock of two birds (scope, pointer) on a pseudo-terminal, measuring a world in real time. Measurement n is of
/// world time n / rate; its last byte leaves the line delay_ms plus the line's own time later.
class SimulatedTracker {
 public:
  SimulatedTracker(PseudoTerminal terminal, const World& world, const TrackerNoise& noise, std::uint64_t seed);

  [[nodiscard]] bool streaming() const { return streaming_; }
  /// The world's time 0, on CLOCK_MONOTONIC. Before it the world stands still.
  void start(std::int64_t world_zero_ns) { zero_ns_ = world_zero_ns; }

 private:
  void run(const std::stop_token& stop);
  [[nodiscard]] std::array<BirdPose, 2> poses(double world_s, std::int64_t cycle) const;

  PseudoTerminal terminal_;
  const World& world_;
  TrackerNoise noise_;
  std::uint64_t seed_;
  std::atomic<bool> streaming_ = false;
  std::atomic<std::int64_t> zero_ns_ = 0;
  std::jthread thread_;
};

}  // namespace birdseye::hw_sim
