#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "calibration/time/rate_limit.hpp"

namespace birdseye::wire {

/// Tells of the connections that are not let in, in few lines however many there are: of the first at once, of those
/// that follow together, ten seconds after the line before at the soonest. Used by one thread.
class RefusalLog {
 public:
  using Tell = std::function<void(const std::string& line)>;
  static constexpr Duration kApart = Duration::from_ms(10'000);

  /// tell: may be empty, then nothing is told.
  explicit RefusalLog(Tell tell) : tell_(std::move(tell)) {}

  /// host: by its address. why: a clause about the host, one of a few texts of this program's own and nothing that the
  /// host has said: each that differs is counted by itself.
  void note(const std::string& host, const std::string& why, DeviceTime now);
  /// Tells of those that wait to be told, once it is time. To be called now and then.
  void tell_due(DeviceTime now);

 private:
  struct OfOneReason {
    std::uint64_t count = 0;
    std::string last_host;
  };

  Tell tell_;
  RateLimit lines_{kApart, 0};
  std::map<std::string, OfOneReason> untold_;  ///< by the reason
};

}  // namespace birdseye::wire
