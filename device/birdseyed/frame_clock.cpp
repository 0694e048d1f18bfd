#include "device/birdseyed/frame_clock.hpp"

namespace birdseye::device {

FrameClock::FrameClock(const Settings& settings) : settings_(settings), exposure_(settings.exposure) {
  restart(settings.rate_hz, settings.exposure);
}

void FrameClock::restart(double rate_hz, std::optional<Duration> exposure) {
  if (rate_hz > 0) settings_.rate_hz = rate_hz;
  exposure_ = exposure.value_or(settings_.exposure);
  line_.reset();
  strobe_.reset();
  if (!settings_.strobe) return;
  StrobeMatcher::Settings strobe{period(), exposure_};
  strobe_.emplace(strobe);
}

void FrameClock::take(const drivers::GpioEdge& edge) {
  if (strobe_ && edge.active) strobe_->push_edge(edge.at);
}

FrameClock::Time FrameClock::time_of(const drivers::Frame& frame) {
  const auto number = static_cast<std::int64_t>(frame.sequence);
  std::string unmatched;
  if (strobe_) {
    const auto match = strobe_->match(frame.acquired_known ? frame.acquired : frame.arrived, number);
    if (match.acquired) return {*match.acquired, match.sigma, true, {}};
    unmatched = match.reason;
  }
  if (frame.acquired_known) return {frame.acquired, frame.acquired_sigma, true, {}};
  if (!line_) {
    ClockLine::Settings settings;
    settings.period = period();
    line_.emplace(settings);
  }
  const ClockLine::Tick tick = line_->push_numbered(frame.arrived, number);
  events_ += line_->take_events().size();
  return {tick.time - settings_.delay, tick.sigma, tick.certain, tick.certain ? std::string() : unmatched};
}

}  // namespace birdseye::device
