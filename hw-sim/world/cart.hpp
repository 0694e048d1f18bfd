#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>

#include "calibration/base/result.hpp"
#include "hw-sim/case/deformation.hpp"
#include "hw-sim/minibird/tracker_script.hpp"
#include "hw-sim/world/world.hpp"

namespace birdseye::hw_sim {

struct CartSettings {
  std::filesystem::path phantom;  ///< a folder that write_phantom wrote
  std::filesystem::path socket;   ///< where the camera listens
  std::filesystem::path tty;      ///< the name of the tracker's terminal
  std::filesystem::path folder;   ///< cart.json and truth/ go here
  std::uint64_t seed = 1;
  BirdNoise noise;
  int width_px = 768, height_px = 576;
  double rate_hz = 25;
  Pace pace;
  double camera_delay_ms = 0;  ///< from exposure to arrival; frames then bear no stamp. 0: frames are stamped
  bool drop_late = false;      ///< true: frames that are not traced in time are left out
  DeformationSettings deformation = {.amplitude_mm = 0};  ///< of the liver since the CT
  double distortion_mm = 0;                               ///< of the tracker's field, where it is largest
  std::filesystem::path faults;  ///< script of faults of either instrument and of the operation, from the world's time
                                 ///< 0 on; or empty
  ReferenceOn reference = ReferenceOn::nothing;  ///< what a third bird is fixed on
};

/// Runs the operation once, in real time, and announces its stages as JSON lines on standard output. It begins a second
/// after the tracker streams and the camera is watched. stop: set by a signal handler.
Result<void> run_cart(const CartSettings& settings, const std::atomic<bool>& stop);

}  // namespace birdseye::hw_sim
