#pragma once

#include <algorithm>
#include <cstddef>
#include <mutex>
#include <vector>

#include "calibration/time/clock.hpp"

namespace birdseye::wire {

/// The latencies since they were last taken. One thread writes them, another takes them. Past kMost, only every second
/// one is kept, then every fourth, and so on.
class LatencyLog {
 public:
  void add(Duration latency) {
    const std::lock_guard lock(mutex_);
    if (seen_++ % every_ != 0) return;
    if (values_.size() == kMost) {
      for (std::size_t i = 0; i < kMost / 2; ++i) values_[i] = values_[2 * i];
      values_.resize(kMost / 2);
      every_ *= 2;
    }
    values_.push_back(latency);
  }
  /// The 99th percentile, ms, of what was added since the last call; 0 for nothing.
  double take_p99_ms() {
    const std::lock_guard lock(mutex_);
    if (values_.empty()) return 0;
    const auto at = values_.begin() + static_cast<std::ptrdiff_t>((values_.size() - 1) * 99 / 100);
    std::nth_element(values_.begin(), at, values_.end());
    const double p99_ms = at->seconds() * 1e3;
    values_.clear();
    seen_ = 0;
    every_ = 1;
    return p99_ms;
  }

 private:
  static constexpr std::size_t kMost = 4096;
  std::mutex mutex_;
  std::vector<Duration> values_;
  std::size_t seen_ = 0, every_ = 1;
};

}  // namespace birdseye::wire
