#pragma once

#include <atomic>
#include <stop_token>

#include "device/birdseyed/instrument_board.hpp"
#include "device/birdseyed/instrument_thread.hpp"
#include "drivers/gpio/gpio_lines.hpp"

namespace birdseye::device {

struct GpioConfig {
  drivers::GpioSettings lines;  ///< no chip: not used
  /// Rate of the pulses on the trigger line, which make a camera take a frame; 0: none.
  double trigger_rate_hz = 0;
};

/// Hands over edges of strobe and pedal, shows the appliance's state on the LED, pulses the trigger. Returns at stop.
void run_gpio(const GpioConfig& config, const std::atomic<ApplianceState>& state, InstrumentPost& post,
              const std::stop_token& stop);

}  // namespace birdseye::device
