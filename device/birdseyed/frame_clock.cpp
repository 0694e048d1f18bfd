#include "device/birdseyed/frame_clock.hpp"

namespace birdseye::device {

namespace {

ClockLine::Settings line_settings(double rate_hz) {
  ClockLine::Settings settings;
  settings.period = Duration::from_seconds(1.0 / rate_hz);
  return settings;
}

}  // namespace

FrameClock::FrameClock(const Settings& settings) : settings_(settings), exposure_(settings.exposure) {}

void FrameClock::restart(double rate_hz, std::optional<Duration> exposure) {
  if (rate_hz > 0) settings_.rate_hz = rate_hz;
  exposure_ = exposure.value_or(settings_.exposure);
  line_.reset();
  last_sequence_.reset();
}

void FrameClock::take(const drivers::GpioEdge&) {}

double FrameClock::drift_ppm() const {
  return 0;
}

FrameClock::Time FrameClock::time_of(const drivers::Frame& frame) {
  if (frame.acquired_known) return {frame.acquired, frame.acquired_sigma, true};
  if (!line_) line_.emplace(line_settings(settings_.rate_hz));
  const std::int64_t lost = last_sequence_ && frame.sequence > *last_sequence_ + 1
                                ? static_cast<std::int64_t>(frame.sequence - *last_sequence_ - 1)
                                : 0;
  last_sequence_ = frame.sequence;
  const ClockLine::Tick tick = line_->push(frame.arrived, lost);
  return {tick.time - settings_.delay, tick.sigma, true};
}

}  // namespace birdseye::device
