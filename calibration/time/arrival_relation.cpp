#include "calibration/time/arrival_relation.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace birdseye {
namespace {

constexpr std::int64_t kBlockNs = 500'000'000;
constexpr double kResolutionNs = 1e5;  // of arrivals: what waking a program takes

}  // namespace

double ArrivalRelation::seconds_to(std::int64_t stamp_ns) const {
  return static_cast<double>(stamp_ns - anchor_stamp_ns_) * 1e-9;
}

std::int64_t ArrivalRelation::bound_at(std::int64_t stamp_ns) const {
  const auto apart_ns = static_cast<double>(std::abs(stamp_ns - earliest_stamp_ns_));
  return earliest_offset_ns_ + std::llround(settings_.most_drift_ppm * 1e-6 * apart_ns);
}

std::int64_t ArrivalRelation::edge_at(std::int64_t stamp_ns) const {
  const std::int64_t fitted_ns =
      anchor_offset_ns_ + std::llround(fit_.value_ns + fit_.slope * (seconds_to(stamp_ns) - fit_s_));
  return std::min(fitted_ns, bound_at(stamp_ns));
}

std::optional<ClockEvent> ArrivalRelation::push(DeviceTime stamp, HostTime arrived) {
  const std::int64_t offset_ns = arrived.ns - stamp.ns;
  std::optional<ClockEvent> stepped;
  if (!blocks_.empty()) {
    const std::int64_t late_ns = offset_ns - edge_at(stamp.ns);
    // Too early cannot be, nor can a network turn the order of stamps: that is a clock that was moved.
    if (late_ns < -settings_.step.ns || stamp.ns < newest_stamp_ns_ - settings_.step.ns) {
      stepped = ClockEvent{ClockEvent::Kind::step, stamp, late_ns, 0};
      blocks_.clear();
    }
    if (stepped || late_ns < settings_.step.ns) {
      late_since_.reset();
      behind_.reset();
    } else if (!late_since_) {
      late_since_ = arrived;
    } else if (arrived - *late_since_ > settings_.behind_confirms) {
      behind_ = Duration{late_ns};
    }
  }
  newest_stamp_ns_ = blocks_.empty() ? stamp.ns : std::max(newest_stamp_ns_, stamp.ns);
  if (blocks_.empty() || offset_ns < bound_at(stamp.ns)) {
    earliest_stamp_ns_ = stamp.ns;
    earliest_offset_ns_ = offset_ns;
  }
  const std::int64_t id = arrived.ns / kBlockNs;
  if (blocks_.empty() || id > blocks_.back().id) {
    blocks_.push_back({id, stamp.ns, offset_ns, 1});
    while ((id - blocks_.front().id) * kBlockNs > settings_.window.ns) blocks_.pop_front();
    refit();
    return stepped;
  }
  Block& last = blocks_.back();
  last.count += 1;
  if (offset_ns < last.offset_ns) {
    last.offset_ns = offset_ns;
    last.stamp_ns = stamp.ns;
    refit();
  }
  return stepped;
}

void ArrivalRelation::refit() {
  anchor_stamp_ns_ = blocks_.front().stamp_ns;
  anchor_offset_ns_ = blocks_.front().offset_ns;
  fit_s_ = seconds_to(blocks_.back().stamp_ns);
  std::vector<EdgePoint> points;
  points.reserve(blocks_.size());
  double least_ns = 0, most_ns = 0;
  for (const Block& block : blocks_) {
    const double x_s = seconds_to(block.stamp_ns);
    const auto y_ns = static_cast<double>(block.offset_ns - anchor_offset_ns_);
    if (points.empty() || x_s > points.back().x_s) points.push_back({x_s, y_ns, block.count});
    least_ns = std::min(least_ns, y_ns);
    most_ns = std::max(most_ns, y_ns);
  }
  const auto fit = fit_edge(points, {0, settings_.drift_sigma_ppm * 1e3}, fit_s_, {0.5, kResolutionNs});
  // Until there are enough for a line: the earliest, and how far apart they are.
  fit_ = fit ? *fit : EdgeFit{least_ns, most_ns - least_ns, 0, settings_.drift_sigma_ppm * 1e3, 0};
}

std::optional<RelatedTime<HostTime>> ArrivalRelation::host_from_device(DeviceTime time) const {
  if (blocks_.empty()) return std::nullopt;
  const double ahead_ns = fit_.slope_sigma * (seconds_to(time.ns) - fit_s_);
  const double sigma_ns =
      std::hypot(std::hypot(fit_.value_sigma_ns, ahead_ns), static_cast<double>(settings_.unseen_delay.ns));
  return RelatedTime<HostTime>{HostTime{time.ns + edge_at(time.ns)} - settings_.unseen_delay, {std::llround(sigma_ns)}};
}

std::optional<DeviceTime> ArrivalRelation::device_from_host(HostTime time) const {
  if (blocks_.empty()) return std::nullopt;
  // The drift over the offset itself does not count: it is taken where the newest stamp is.
  const std::int64_t offset_ns = edge_at(blocks_.back().stamp_ns) - settings_.unseen_delay.ns;
  return DeviceTime{time.ns - offset_ns};
}

}  // namespace birdseye
