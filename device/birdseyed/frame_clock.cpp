#include "device/birdseyed/frame_clock.hpp"

namespace birdseye::device {

FrameClock::FrameClock(const Settings& settings) : settings_(settings) {
  restart(settings.rate_hz, settings.exposure);
}

void FrameClock::restart(double rate_hz, std::optional<Duration> exposure) {
  if (rate_hz > 0) settings_.rate_hz = rate_hz;
  exposure_ = exposure.value_or(settings_.exposure);
  line_.reset();
  stamps_.reset();
  strobe_.reset();
  if (!settings_.strobe) return;
  StrobeMatcher::Settings strobe{period(), exposure_};
  strobe_.emplace(strobe);
}

void FrameClock::take(const drivers::GpioEdge& edge) {
  if (strobe_ && edge.active) strobe_->push_edge(edge.at);
}

ClockLine::Tick FrameClock::push(std::optional<ClockLine>& line, DeviceTime at, std::int64_t number) {
  if (!line) {
    ClockLine::Settings settings;
    settings.period = period();
    line.emplace(settings);
  }
  const ClockLine::Tick tick = line->push_numbered(at, number);
  events_ += line->take_events().size();
  return tick;
}

FrameClock::Time FrameClock::time_of(const drivers::Frame& frame) {
  const auto number = static_cast<std::int64_t>(frame.sequence);
  std::string unmatched;
  if (frame.acquired_known) push(stamps_, frame.acquired, number);
  if (strobe_) {
    const auto match = strobe_->match(frame.acquired_known ? frame.acquired : frame.arrived, number);
    if (match.acquired) return {*match.acquired, match.sigma, true, {}};
    unmatched = match.reason;
  }
  if (frame.acquired_known) return {frame.acquired, frame.acquired_sigma, true, {}};
  const ClockLine::Tick tick = push(line_, frame.arrived, number);
  return {tick.time - settings_.delay, in_quadrature(tick.sigma, kWakeSigma), tick.certain, tick.certain ? std::string() : unmatched};
}

}  // namespace birdseye::device
