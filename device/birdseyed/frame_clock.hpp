#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/time/clock_line.hpp"
#include "calibration/time/strobe_matcher.hpp"
#include "drivers/gpio/gpio_lines.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::device {

/// Tells when a frame was taken: by the strobe, where an edge is surely this frame's; else by the camera's stamp; else
/// from the arrivals of frames. The frame's stamp, or its arrival less the delay, tells which edge is its own, and must
/// be right to half a period for that.
class FrameClock {
 public:
  struct Settings {
    double rate_hz = 25;
    /// For frames without a stamp: the least time from the middle of the exposure to the arrival. Empty: anything up to
    /// a period; with a strobe, a frame then has no time until the strobe gives one.
    std::optional<Duration> delay;
    /// The exposure, where the camera does not tell it: the strobe marks the exposure's start, and its middle is
    /// sought.
    Duration exposure{0};
    bool strobe = false;  ///< edges come
  };
  struct Time {
    DeviceTime acquired;
    Duration sigma;
    bool certain = true;  ///< false: the time has yet to be made out
    std::string reason;   ///< why not, in words
    /// How far the camera's stamp lies ahead of the frame's arrival, where that is more than its sigma allows: it is
    /// not believed, and `acquired` is the arrival.
    std::optional<Duration> ahead;
  };

  explicit FrameClock(const Settings& settings);

  /// A camera starts, or starts anew: what was learned before is forgotten.
  void restart(double rate_hz, std::optional<Duration> exposure);
  void take(const drivers::GpioEdge& edge);
  /// The time of a frame. Must be called for each frame, in order.
  Time time_of(const drivers::Frame& frame);
  /// Drift of the line under the arrivals; 0 where the camera stamps its frames.
  [[nodiscard]] double drift_ppm() const { return line_ ? line_->drift_ppm() : 0; }
  /// Edges too close to another to be a frame's, so far.
  [[nodiscard]] std::uint64_t spurious_strobe_edges() const {
    return spurious_before_ + (strobe_ ? strobe_->spurious_edges() : 0);
  }
  /// What happened to the camera's clock since the last call.
  std::vector<ClockEvent> take_events() { return std::exchange(events_, {}); }

 private:
  StrobeMatcher::Match match(const drivers::Frame& frame, std::int64_t number);
  ClockLine::Tick push(std::optional<ClockLine>& line, DeviceTime at, std::int64_t number);
  [[nodiscard]] Duration period() const { return Duration::from_seconds(1 / settings_.rate_hz); }

  Settings settings_;
  Duration exposure_;
  std::optional<ClockLine> line_;        ///< under the arrivals of frames without a stamp
  std::optional<ClockLine> stamps_;      ///< under the stamps: shows that they jump
  std::optional<StrobeMatcher> strobe_;  ///< from the first frame on
  bool strobe_by_stamps_ = false;
  std::uint64_t spurious_before_ = 0;  ///< of strobe_'s predecessors
  std::vector<ClockEvent> events_;
};

}  // namespace birdseye::device
