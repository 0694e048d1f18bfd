#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <string>

#include "calibration/time/rate_limit.hpp"

namespace birdseye::wire {

/// One limit a machine for the handshakes that it begins. No more than most_hosts machines are remembered. To make room
/// for a new one, the one is forgotten that has the most left of its limit, but never one that has to wait: else
/// whoever comes from many addresses would free all of them. Where all have to wait, a new one has to as well.
class HandshakeLimits {
 public:
  HandshakeLimits(Duration apart, std::int64_t at_once, std::size_t most_hosts)
      : apart_(apart), at_once_(at_once), most_hosts_(most_hosts) {}

  /// Whether the machine may begin a handshake now, which then counts.
  bool pass(const std::string& host, DeviceTime now) {
    std::erase_if(limits_, [&](const auto& of_one) { return of_one.second.rested(now); });
    if (!limits_.contains(host) && limits_.size() >= most_hosts_ && !forget_one(now)) return false;
    RateLimit& limit = limits_.try_emplace(host, apart_, at_once_).first->second;
    if (now < limit.free_at()) return false;
    limit.passed(now);
    return true;
  }

 private:
  bool forget_one(DeviceTime now) {
    const auto freest =
        std::ranges::min_element(limits_, {}, [](const auto& of_one) { return of_one.second.free_at(); });
    if (freest == limits_.end() || now < freest->second.free_at()) return false;
    limits_.erase(freest);
    return true;
  }

  Duration apart_;
  std::int64_t at_once_;
  std::size_t most_hosts_;
  std::map<std::string, RateLimit> limits_;
};

}  // namespace birdseye::wire
