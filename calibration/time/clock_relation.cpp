#include "calibration/time/clock_relation.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace birdseye {
namespace {

constexpr std::size_t kMostSamples = 256;
constexpr int kStepConfirms = 3;
constexpr double kMostDriftSigmas = 2;

}  // namespace

double ClockRelation::offset_at(std::int64_t device_ns) const {
  return level_ns_ + slope_ * (static_cast<double>(device_ns - anchor_device_ns_) * 1e-9 - fit_s_);
}

double ClockRelation::sigma_at(std::int64_t device_ns) const {
  const double from_s = static_cast<double>(device_ns - anchor_device_ns_) * 1e-9 - fit_s_;
  const double bend_ns = settings_.wander_ppm_per_s * 1e3 * from_s * from_s / 2;
  const double spread =
      std::sqrt(level_sigma_ns_ * level_sigma_ns_ + slope_sigma_ * slope_sigma_ * from_s * from_s + bend_ns * bend_ns);
  return std::max(spread, 0.5 * static_cast<double>(bound_.ns));
}

/// The line's offset, within the bounds of the exchange that leaves least open at that time. Where many exchanges were
/// slow in the same direction the line itself lies outside these bounds.
ClockRelation::Offset ClockRelation::related_at(std::int64_t device_ns) const {
  double middle_ns = 0, half_ns = std::numeric_limits<double>::infinity();
  for (const Sample& sample : samples_) {
    // By what clocks may differ in rate, and not by the slope, which exchanges that are slow in the same way bend.
    const double since_s = std::abs(static_cast<double>(device_ns - sample.device_ns)) * 1e-9;
    const double open_ns = sample.half_ns + kMostDriftSigmas * settings_.drift_sigma_ppm * 1e3 * since_s;
    if (open_ns >= half_ns) continue;
    half_ns = open_ns;
    middle_ns = static_cast<double>(sample.offset_ns - anchor_offset_ns_);
  }
  const double offset_ns = std::clamp(offset_at(device_ns), middle_ns - half_ns, middle_ns + half_ns);
  const double farthest_ns = std::abs(offset_ns - middle_ns) + half_ns;
  return {anchor_offset_ns_ + std::llround(offset_ns), std::llround(std::max(sigma_at(device_ns), 0.5 * farthest_ns))};
}

bool ClockRelation::contradicts(const Sample& sample) const {
  // Outside what its own round trip, the best one's and the drift allow: the true offset lies within the half round
  // trip of each exchange, always.
  const double apart =
      std::abs(static_cast<double>(sample.offset_ns - anchor_offset_ns_) - offset_at(sample.device_ns));
  const double allowed = sample.half_ns + static_cast<double>(bound_.ns) + 4 * sigma_at(sample.device_ns);
  return apart > allowed;
}

bool ClockRelation::push(const ClockExchange& exchange) {
  const Duration away = exchange.host_received - exchange.host_sent;
  const Duration there = exchange.device_sent - exchange.device_received;
  if (there.ns < 0 || away.ns < there.ns) return false;
  Sample sample;
  sample.device_ns = exchange.device_received.ns + there.ns / 2;
  sample.offset_ns = exchange.host_sent.ns + away.ns / 2 - sample.device_ns;
  sample.half_ns = static_cast<double>(away.ns - there.ns) / 2;
  if (!samples_.empty() && sample.device_ns <= samples_.back().device_ns) return false;
  if (!samples_.empty() && contradicts(sample)) {
    // One is a wrong stamp; three in a row are a clock that was moved, or a machine that slept.
    if (++contradictions_ < kStepConfirms) return true;
    const double by_ns = static_cast<double>(sample.offset_ns - anchor_offset_ns_) - offset_at(sample.device_ns);
    if (events_.size() == 64) events_.pop_front();
    events_.push_back({ClockEvent::Kind::step, {sample.device_ns}, std::llround(by_ns), 0});
    samples_.clear();
  }
  contradictions_ = 0;
  samples_.push_back(sample);
  while (samples_.size() > kMostSamples ||
         samples_.back().device_ns - samples_.front().device_ns > settings_.window.ns) {
    samples_.pop_front();
  }
  refit();
  return true;
}

/// Weighted line through the offsets, each with the deviation its round trip gives it: an exchange that took longer
/// than the best by e may be off by half of e to either side, beside what the best one's asymmetry moves all of them.
void ClockRelation::refit() {
  anchor_device_ns_ = samples_.back().device_ns;
  anchor_offset_ns_ = samples_.back().offset_ns;
  double least = samples_.front().half_ns, sum = 0;
  for (const Sample& s : samples_) {
    least = std::min(least, s.half_ns);
    sum += s.half_ns;
  }
  bound_ = {std::llround(least)};
  // Exchanges as fast as the best still scatter by something: a tenth of the usual queueing, 1 us at least.
  const double floor = std::max(1000.0, 0.1 * (sum / static_cast<double>(samples_.size()) - least));
  double w = 0, wt = 0, wtt = 0, wy = 0, wty = 0;
  for (const Sample& s : samples_) {
    const double deviation = floor + (s.half_ns - least);
    const double weight = 1 / (deviation * deviation);
    const double t = static_cast<double>(s.device_ns - anchor_device_ns_) * 1e-9;
    const auto y = static_cast<double>(s.offset_ns - anchor_offset_ns_);
    w += weight;
    wt += weight * t;
    wtt += weight * t * t;
    wy += weight * y;
    wty += weight * t * y;
  }
  const double prior = 1 / (settings_.drift_sigma_ppm * settings_.drift_sigma_ppm * 1e6);
  fit_s_ = wt / w;
  level_ns_ = wy / w;
  const double stt = wtt - wt * fit_s_ + prior;
  slope_ = (wty - fit_s_ * wy) / stt;
  slope_sigma_ = 1 / std::sqrt(stt);
  level_sigma_ns_ = 1 / std::sqrt(w);
}

std::optional<RelatedTime<HostTime>> ClockRelation::host_from_device(DeviceTime time) const {
  if (samples_.empty()) return std::nullopt;
  const Offset offset = related_at(time.ns);
  return RelatedTime<HostTime>{{time.ns + offset.ns}, {offset.sigma_ns}};
}

std::optional<RelatedTime<DeviceTime>> ClockRelation::device_from_host(HostTime time) const {
  if (samples_.empty()) return std::nullopt;
  // The offset changes by parts per million of itself: twice is to the nanosecond.
  std::int64_t device_ns = time.ns - anchor_offset_ns_;
  for (int i = 0; i < 3; ++i) device_ns = time.ns - related_at(device_ns).ns;
  return RelatedTime<DeviceTime>{{device_ns}, {related_at(device_ns).sigma_ns}};
}

std::vector<ClockEvent> ClockRelation::take_events() {
  std::vector<ClockEvent> events(events_.begin(), events_.end());
  events_.clear();
  return events;
}

}  // namespace birdseye
