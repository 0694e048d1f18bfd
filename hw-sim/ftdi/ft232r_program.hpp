#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "calibration/base/result.hpp"
#include "hw-sim/ftdi/ft232r.hpp"
#include "hw-sim/minibird/tracker_script.hpp"

namespace birdseye::hw_sim {

/// `birdseye-sim ft232r`.
struct Ft232rProgram {
  std::filesystem::path socket;  ///< of QEMU's usb-redir device
  Ft232rSettings chip;
  TrackerSettings tracker;  ///< at the other end of the adapter's line
  std::string motion = "circle";
  double period_s = 2;  ///< of the circle
};

/// Plugs the adapter, with the tracker behind it, into QEMU and serves it in real time until `stop`; waits for a QEMU
/// that is not there yet, or has gone. Commands come on standard input, one a line: unplug, plug, overrun, parity,
/// framing, break. Tells what happens on standard output, as JSON lines.
Result<void> run_ft232r(const Ft232rProgram& program, const std::atomic<bool>& stop);

}  // namespace birdseye::hw_sim
