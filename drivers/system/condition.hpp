#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>

#include "drivers/system/clock.hpp"

namespace birdseye {

/// What threads wait on that share a mutex: until something that it guards holds, which whoever changes it tells.
class Condition {
 public:
  using Lock = std::unique_lock<std::mutex>;

  void notify_one() { changed_.notify_one(); }
  void notify_all() { changed_.notify_all(); }
  /// Whether it holds, by the deadline at the latest.
  template <typename Holds>
  bool wait(Lock& lock, Deadline deadline, Holds holds) {
    return wait(lock, std::stop_token(), deadline, holds);
  }
  /// The same, and no longer than until stop is requested.
  template <typename Holds>
  bool wait(Lock& lock, const std::stop_token& stop, Deadline deadline, Holds holds) {
    while (!holds()) {
      const Duration left = deadline.left();
      if (left.ns == 0 || stop.stop_requested()) return false;
      changed_.wait_for(lock, stop, std::chrono::nanoseconds(left.ns), holds);
    }
    return true;
  }
  template <typename Holds>
  bool wait(Lock& lock, const std::stop_token& stop, Holds holds) {
    return changed_.wait(lock, stop, holds);
  }

 private:
  std::condition_variable_any changed_;
};

}  // namespace birdseye
