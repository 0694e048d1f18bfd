#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "calibration/time/clock.hpp"
#include "calibration/time/clock_line.hpp"

namespace birdseye {

/// One question and its answer over the wire, each stamped where it left and where it came.
struct ClockExchange {
  HostTime host_sent;
  DeviceTime device_received, device_sent;
  HostTime host_received;
};

template <typename Time>
struct RelatedTime {
  Time time;
  Duration sigma;
};

/// Relates the host's clock to the device's by the exchanges that took least time. An exchange leaves the offset
/// anywhere within plus and minus half its round trip, for nobody knows how the two ways share it; the narrowest
/// exchanges give the narrowest bounds. A constant asymmetry shows in no number of exchanges. So sigma is never less
/// than half of the best half round trip: an even distribution within the bounds has a sigma of 0.58 of the half round
/// trip, and a way there that takes three times as long as the way back is off by just one sigma. The truth is at most
/// two sigmas away, however the ways share their time, where the clocks' rates differ by two drift_sigma_ppm at most.
class ClockRelation {
 public:
  struct Settings {
    Duration window = Duration::from_ms(120'000);
    double drift_sigma_ppm = 100;  ///< what two machines' clocks may differ by in rate
    double wander_ppm_per_s = 0.01;
  };

  ClockRelation() = default;
  explicit ClockRelation(const Settings& settings) : settings_(settings) {}

  /// False, and nothing kept, where the stamps contradict each other (an answer before its question).
  bool push(const ClockExchange& exchange);
  /// Empty until there was an exchange.
  [[nodiscard]] std::optional<RelatedTime<HostTime>> host_from_device(DeviceTime time) const;
  [[nodiscard]] std::optional<RelatedTime<DeviceTime>> device_from_host(HostTime time) const;
  /// By how much the host's clock is faster than the device's.
  [[nodiscard]] double drift_ppm() const { return slope_ * 1e-3; }
  [[nodiscard]] double drift_sigma_ppm() const { return slope_sigma_ * 1e-3; }
  /// Half the round trip of the best exchange in the window: no asymmetry makes the offset worse than this.
  [[nodiscard]] Duration bound() const { return bound_; }
  std::vector<ClockEvent> take_events();

 private:
  struct Sample {
    std::int64_t device_ns = 0;  ///< the middle of its stay at the device
    std::int64_t offset_ns = 0;  ///< host - device, as if both ways took the same time
    double half_ns = 0;          ///< half of what the two ways took together
  };
  struct Offset {
    std::int64_t ns = 0, sigma_ns = 0;  ///< host - device
  };
  void refit();
  [[nodiscard]] Offset related_at(std::int64_t device_ns) const;
  [[nodiscard]] bool contradicts(const Sample& sample) const;
  [[nodiscard]] double offset_at(std::int64_t device_ns) const;
  [[nodiscard]] double sigma_at(std::int64_t device_ns) const;

  Settings settings_;
  std::deque<Sample> samples_;
  std::int64_t anchor_device_ns_ = 0, anchor_offset_ns_ = 0;
  double level_ns_ = 0, level_sigma_ns_ = 0, slope_ = 0, slope_sigma_ = 0;
  double fit_s_ = 0;  ///< where level and slope are independent, from the anchor
  Duration bound_;
  int contradictions_ = 0;
  std::deque<ClockEvent> events_;
};

}  // namespace birdseye
