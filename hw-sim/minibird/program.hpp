#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"
#include "hw-sim/minibird/tracker_script.hpp"

namespace birdseye::hw_sim {

/// `birdseye-sim minibird`: one of tty, tcp and unix_socket is given.
struct MiniBirdProgram {
  std::filesystem::path tty, unix_socket;
  std::string tcp;
  std::string motion = "circle";
  double period_s = 2;          ///< of the circle
  std::filesystem::path truth;  ///< empty: none is written
  double seconds = 0;           ///< 0: until it is stopped
  TrackerSettings tracker;
};

/// Runs until stop, which a signal handler sets.
Result<void> run_minibird(const MiniBirdProgram& program, const std::atomic<bool>& stop);

}  // namespace birdseye::hw_sim
