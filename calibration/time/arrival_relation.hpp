#pragma once

#include <deque>
#include <optional>

#include "calibration/time/clock_relation.hpp"
#include "calibration/time/edge_fit.hpp"

namespace birdseye {

/// Relates the host's clock to that of a sender which stamps what it sends and answers no questions, by arrivals
/// alone. What arrives is late by a delay that is never negative, so the earliest arrivals lie on a line, the lower
/// edge. How late even the earliest were shows in no number of arrivals. Times are therefore put earlier by
/// Settings::unseen_delay, so that a picture is taken for older rather than newer than it is, and sigma is never less
/// than that. The edge rises no faster than clocks drift: when a network grows slower for good, what it carries is
/// taken for as old as it is.
class ArrivalRelation {
 public:
  struct Settings {
    Duration window = Duration::from_ms(30'000);
    Duration unseen_delay = Duration::from_ms(20);  ///< sending and the network, at their fastest
    double drift_sigma_ppm = 100;                   ///< what two machines' clocks may differ by in rate
    double most_drift_ppm = 100;                    ///< what the edge may rise by, against the earliest arrival
    Duration step = Duration::from_ms(500);         ///< earlier, or stamped as much earlier: a clock that was moved
    Duration behind_confirms = Duration::from_ms(3000);
  };

  ArrivalRelation() = default;
  explicit ArrivalRelation(const Settings& settings) : settings_(settings) {}

  /// Stamps need not be in order. Returns a step of the sender's clock if the arrival shows one; what was known before
  /// is then dropped.
  std::optional<ClockEvent> push(DeviceTime stamp, HostTime arrived);
  /// Empty until something arrived.
  [[nodiscard]] std::optional<RelatedTime<HostTime>> host_from_device(DeviceTime time) const;
  [[nodiscard]] std::optional<DeviceTime> device_from_host(HostTime time) const;
  /// By how much everything comes later than the earliest did, where that has been more than a step for some seconds:
  /// the network does not carry what is sent.
  [[nodiscard]] std::optional<Duration> behind() const { return behind_; }

 private:
  /// The earliest arrival of a part of the window.
  struct Block {
    std::int64_t id = 0;
    std::int64_t stamp_ns = 0, offset_ns = 0;  ///< offset: arrival less stamp
    double count = 0;
  };
  [[nodiscard]] double seconds_to(std::int64_t stamp_ns) const;
  [[nodiscard]] std::int64_t edge_at(std::int64_t stamp_ns) const;
  /// The highest that the edge may be, by the earliest arrival of all.
  [[nodiscard]] std::int64_t bound_at(std::int64_t stamp_ns) const;
  void refit();

  Settings settings_;
  std::deque<Block> blocks_;
  std::int64_t anchor_stamp_ns_ = 0, anchor_offset_ns_ = 0;  ///< doubles are relative to these
  EdgeFit fit_;
  double fit_s_ = 0;
  std::int64_t earliest_stamp_ns_ = 0, earliest_offset_ns_ = 0, newest_stamp_ns_ = 0;
  std::optional<HostTime> late_since_;
  std::optional<Duration> behind_;
};

}  // namespace birdseye
