#pragma once

#include <cstdint>
#include <deque>

#include "calibration/time/clock.hpp"

namespace birdseye {

/// Gives a periodic measurement back its regular times. What arrives is late by a delay that is never negative and
/// jitters; the earliest arrivals lie on a line of known slope (the period), and that lower envelope is the clock.
class ClockLine {
 public:
  struct Settings {
    Duration period;                ///< nominal; an error of 100 ppm costs a tenth of a millisecond a second
    std::size_t window = 200;       ///< arrivals over which the envelope is taken
    std::size_t slip_confirms = 8;  ///< arrivals in a row that are late by a period: measurements were lost
  };
  struct Tick {
    DeviceTime time;   ///< on the line
    Duration sigma;    ///< how well the fastest arrivals agree on the line; late_by, where that is over 0.7 periods
    Duration late_by;  ///< this arrival behind its tick
  };

  explicit ClockLine(const Settings& settings) : settings_(settings) {}

  /// The next arrival, or one after some that are known to be lost.
  Tick push(DeviceTime arrived, std::int64_t lost = 0);
  /// Times the line had to be begun anew because an arrival was early: the period was not what it was said to be.
  [[nodiscard]] std::uint64_t restarts() const { return restarts_; }

 private:
  [[nodiscard]] std::int64_t offset_of(DeviceTime arrived) const;

  Settings settings_;
  std::int64_t origin_ns_ = 0;
  std::int64_t index_ = -1;
  std::deque<std::int64_t> offsets_ns_;  ///< arrival - origin - index * period, newest last
  std::size_t late_in_a_row_ = 0;
  std::uint64_t restarts_ = 0;
};

}  // namespace birdseye
