#pragma once

#include <algorithm>
#include <cstdint>

#include "calibration/time/clock.hpp"

namespace birdseye {

/// Lets one pass every so often, and so many more at once after a rest: the generic cell rate algorithm (ITU-T I.371).
class RateLimit {
 public:
  RateLimit(Duration apart, std::int64_t at_once) : apart_(apart), at_once_{at_once * apart.ns} {}

  /// From when on the next may pass.
  [[nodiscard]] DeviceTime free_at() const { return owed_until_ - at_once_; }
  /// Whether as many may pass at once as ever.
  [[nodiscard]] bool rested(DeviceTime now) const { return owed_until_ <= now; }
  void passed(DeviceTime now, std::int64_t count = 1) {
    owed_until_ = std::max(owed_until_, now) + Duration{count * apart_.ns};
  }

 private:
  Duration apart_, at_once_;
  DeviceTime owed_until_;  ///< by when all that passed would have, one by one
};

}  // namespace birdseye
