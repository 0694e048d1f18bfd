#pragma once

#include <cmath>
#include <vector>

#include "drivers/minibird/stream_layout.hpp"
#include "hw-sim/minibird/unit.hpp"

namespace birdseye::testing {

/// What a simulated unit of one bird sends while it streams positions and matrices: the sensor goes round a circle.
class TrackerBytesSource {
 public:
  TrackerBytesSource() : unit_(hw_sim::UnitSettings{}) {
    for (const char command : {'Z', 'F', '@'}) unit_.receive(static_cast<std::uint8_t>(command));
  }
  static drivers::minibird::StreamLayout layout() {
    drivers::minibird::StreamLayout layout;
    layout.delay = Duration{7'500'000};
    layout.plausibility.frozen_after = 0;  // there is no noise
    return layout;
  }
  static hw_sim::BirdPose pose_at(double seconds) {
    const double angle = 3.14159265358979 * seconds;
    hw_sim::BirdPose pose;
    pose.position_mm = {400 + 200 * std::cos(angle), 200 * std::sin(angle), 50};
    return pose;
  }
  /// The bytes of the measurement at `seconds`.
  std::vector<std::uint8_t> measure(double seconds) {
    const hw_sim::BirdPose pose = pose_at(seconds);
    return unit_.measure({&pose, 1});
  }

 private:
  hw_sim::Unit unit_;
};

}  // namespace birdseye::testing
