#pragma once

#include <atomic>
#include <filesystem>

#include "calibration/base/result.hpp"
#include "hw-sim/ftdi/ft232r.hpp"
#include "hw-sim/ftdi/instrument.hpp"

namespace birdseye::hw_sim {

struct Ft232rProgram {
  std::filesystem::path socket;  ///< of QEMU's usb-redir device
  Ft232rSettings chip;
};

/// Plugs the adapter, with the instrument behind it, into QEMU and serves it in real time until `stop`; a QEMU that is
/// not there yet, or goes, is waited for. Commands come on standard input, one a line: unplug, plug, overrun, parity,
/// framing, break. What happens is told on standard output as JSON lines.
Result<void> run_ft232r(const Ft232rProgram& settings, SerialInstrument& instrument, const std::atomic<bool>& stop);

}  // namespace birdseye::hw_sim
