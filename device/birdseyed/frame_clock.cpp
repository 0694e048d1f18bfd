#include "device/birdseyed/frame_clock.hpp"

#include <fmt/format.h>

#include <cmath>

namespace birdseye::device {

namespace {

/// How far before and after where it is expected a frame may follow its edge, in periods; less than one together, for
/// otherwise nothing tells one edge from the next. More after than before: delays are known at the least.
constexpr double kEarlier = 0.4, kLater = 0.55;

/// A frame cannot arrive before the middle of its exposure; stamp and arrival are read one after the other.
constexpr std::int64_t kSurely = 3;  // sigmas
constexpr Duration kClockReads = Duration::from_ms(1);

}  // namespace

FrameClock::FrameClock(const Settings& settings) : settings_(settings) {
  restart(settings.rate_hz, settings.exposure);
}

void FrameClock::restart(double rate_hz, std::optional<Duration> exposure) {
  if (rate_hz > 0) settings_.rate_hz = rate_hz;
  exposure_ = exposure.value_or(settings_.exposure);
  line_.reset();
  stamps_.reset();
  spurious_before_ = spurious_strobe_edges();
  strobe_.reset();
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
  for (const ClockEvent& event : line->take_events()) events_.push_back(event);
  return tick;
}

StrobeMatcher::Match FrameClock::match(const drivers::Frame& frame, std::int64_t number) {
  const bool by_stamps = frame.acquired_known;
  if (!strobe_ || strobe_by_stamps_ != by_stamps) {
    StrobeMatcher::Settings settings{period(), exposure_};
    if (by_stamps || settings_.delay) {
      const double expected_s = exposure_.seconds() / 2 + (by_stamps ? 0.0 : settings_.delay->seconds());
      settings.least_delay = Duration::from_seconds(expected_s - kEarlier * period().seconds());
      settings.most_delay = Duration::from_seconds(expected_s + kLater * period().seconds());
    }
    spurious_before_ = spurious_strobe_edges();
    strobe_.emplace(settings);
    strobe_by_stamps_ = by_stamps;
  }
  return strobe_->match(by_stamps ? frame.acquired : frame.arrived, number);
}

FrameClock::Time FrameClock::time_of(const drivers::Frame& frame) {
  const auto number = static_cast<std::int64_t>(frame.sequence);
  std::string unmatched;
  if (frame.acquired_known) push(stamps_, frame.acquired, number);
  if (settings_.strobe) {
    const auto found = match(frame, number);
    if (found.acquired) return {*found.acquired, found.sigma, true, {}, {}};
    unmatched = found.reason;
  }
  if (frame.acquired_known) {
    const Duration ahead = frame.acquired - frame.arrived;
    if (ahead.ns > kSurely * frame.acquired_sigma.ns + kClockReads.ns) {
      return {frame.arrived, frame.acquired_sigma, false,
              fmt::format("the camera's stamps lie {:.0f} ms ahead of the clock", ahead.seconds() * 1e3), ahead};
    }
    return {frame.acquired, frame.acquired_sigma, true, {}, {}};
  }
  const ClockLine::Tick tick = push(line_, frame.arrived, number);
  // A delay that nobody has told is any from none to a period, as drivers/video/frame_stamp.cpp takes it.
  const DeviceTime acquired = tick.time - settings_.delay.value_or(Duration{period().ns / 2});
  const Duration unknown = settings_.delay ? Duration{0} : Duration::from_seconds(period().seconds() / std::sqrt(12.0));
  const Duration sigma = in_quadrature(in_quadrature(tick.sigma, kWakeSigma), unknown);
  if (settings_.strobe && !settings_.delay)
    return {acquired, sigma, false, unmatched + ", and the camera's delay_ms is not set", {}};
  if (!tick.certain) return {acquired, sigma, false, "frames do not come at the camera's rate_hz", {}};
  return {acquired, sigma, true, {}, {}};
}

}  // namespace birdseye::device
