#pragma once

#include <map>
#include <memory>
#include <string>

#include "calibration/time/rate_limit.hpp"

namespace birdseye::wire {

/// One limit a machine for what all its connections ask together. It outlives them until the machine has rested:
/// whoever connects anew is not free to ask anew.
class HostLimits {
 public:
  HostLimits(Duration apart, std::int64_t at_once) : apart_(apart), at_once_(at_once) {}

  std::shared_ptr<RateLimit> of(const std::string& host, DeviceTime now) {
    std::erase_if(limits_,
                  [&](const auto& of_one) { return of_one.second.use_count() == 1 && of_one.second->rested(now); });
    auto& limit = limits_[host];
    if (!limit) limit = std::make_shared<RateLimit>(apart_, at_once_);
    return limit;
  }

 private:
  Duration apart_;
  std::int64_t at_once_;
  std::map<std::string, std::shared_ptr<RateLimit>> limits_;
};

}  // namespace birdseye::wire
