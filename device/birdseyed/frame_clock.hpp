#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/time/clock_line.hpp"
#include "calibration/time/strobe_matcher.hpp"
#include "drivers/gpio/gpio_lines.hpp"
#include "drivers/video/frame_source.hpp"

namespace birdseye::device {

/// When a frame was taken: by the strobe where there is one and it is surely this frame's, else by the camera's stamp,
/// else from when frames arrive. Which edge is a frame's, its stamp tells, or its arrival less the delay: either must
/// be right to half a period.
class FrameClock {
 public:
  struct Settings {
    double rate_hz = 25;
    /// Of a frame without a stamp: from the middle of the exposure to its arrival, at the least. Empty: anything up to
    /// a period; or, with a strobe, no time at all until the strobe gives one.
    std::optional<Duration> delay;
    /// For the strobe, which marks the exposure's start, where the camera does not say.
    Duration exposure{0};
    bool strobe = false;  ///< edges come
  };
  struct Time {
    DeviceTime acquired;
    Duration sigma;
    bool certain = true;  ///< false: it has yet to be made out
    std::string reason;   ///< why not, in words
  };

  explicit FrameClock(const Settings& settings);

  /// A camera that (re)starts: what was learned of the old one is forgotten.
  void restart(double rate_hz, std::optional<Duration> exposure);
  void take(const drivers::GpioEdge& edge);
  /// Of each frame, in order.
  Time time_of(const drivers::Frame& frame);
  /// Of the line under the arrivals; 0 where the camera stamps its frames.
  [[nodiscard]] double drift_ppm() const { return line_ ? line_->drift_ppm() : 0; }
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
  std::vector<ClockEvent> events_;
};

}  // namespace birdseye::device
