#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/clock.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::drivers {

enum class GpioBias { as_is, pull_up, pull_down };

/// Lines by name or number; an empty one is not used.
struct GpioSettings {
  std::string chip;  ///< /dev/gpiochip0, gpiochip0, or its label
  std::string strobe, pedal, led, trigger;
  Duration pedal_debounce = Duration::from_ms(20);
  bool strobe_active_low = false, pedal_active_low = false, led_active_low = false, trigger_active_low = false;
  GpioBias strobe_bias = GpioBias::as_is, pedal_bias = GpioBias::as_is;
};

enum class GpioInput { strobe, pedal };

struct GpioEdge {
  GpioInput input = GpioInput::strobe;
  bool active = false;
  DeviceTime at;  ///< stamped by the kernel; of a bouncing pedal, the first edge
};

struct GpioCounters {
  std::uint64_t edges = 0;    ///< as the kernel gave them
  std::uint64_t bounces = 0;  ///< edges of the pedal that made neither a press nor a release
  std::uint64_t lost = 0;     ///< edges that must have been there, for a line went the same way twice
};

/// The cart's own lines on one GPIO chip: strobe and pedal in, status LED and trigger out. One thread reads; others may
/// set outputs meanwhile.
class GpioLines {
 public:
  /// Asks the kernel for all lines of settings. An error says which line or chip is not there, is held by another
  /// program, or may not be used.
  static Result<std::unique_ptr<GpioLines>> open(const GpioSettings& settings);
  virtual ~GpioLines() = default;

  /// The edges since the last call, oldest first, as soon as there is one; empty at the deadline. At most kMostEdges;
  /// the next call gives the rest. Errc::disconnected when the chip is gone.
  virtual Result<std::vector<GpioEdge>> read(Deadline deadline) = 0;
  /// Does nothing where the settings name no such line.
  virtual Result<void> set_led(bool on) = 0;
  virtual Result<void> set_trigger(bool on) = 0;
  [[nodiscard]] virtual GpioCounters counters() const = 0;
  /// One line of text: the chip and its lines.
  [[nodiscard]] virtual std::string describe() const = 0;

  static constexpr std::size_t kMostEdges = 64;
};

}  // namespace birdseye::drivers
