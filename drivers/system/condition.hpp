#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <limits>
#include <mutex>
#include <stop_token>

#include "drivers/system/clock.hpp"
#include "drivers/system/time_keeper.hpp"

namespace birdseye {

/// What threads wait on that share a mutex: until something that it guards holds, which whoever changes it tells.
class Condition {
 public:
  using Lock = std::unique_lock<std::mutex>;

  void notify_one() {
    if (TimeKeeper* const keeper = TimeKeeper::present()) return keeper->tell(this, false);
    changed_.notify_one();
  }
  void notify_all() {
    if (TimeKeeper* const keeper = TimeKeeper::present()) return keeper->tell(this, true);
    changed_.notify_all();
  }
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
      if (TimeKeeper* const keeper = TimeKeeper::present()) {
        wait_told(*keeper, lock, stop, deadline.ns_);
      } else {
        changed_.wait_for(lock, stop, std::chrono::nanoseconds(left.ns), holds);
      }
    }
    return true;
  }
  template <typename Holds>
  bool wait(Lock& lock, const std::stop_token& stop, Holds holds) {
    TimeKeeper* const keeper = TimeKeeper::present();
    if (keeper == nullptr) return changed_.wait(lock, stop, holds);
    while (!holds()) {
      if (stop.stop_requested()) return false;
      wait_told(*keeper, lock, stop, std::numeric_limits<std::int64_t>::max());
    }
    return true;
  }

 private:
  /// Nobody else runs between a look at what is waited for and the wait.
  void wait_told(TimeKeeper& keeper, Lock& lock, const std::stop_token& stop, std::int64_t until_ns) {
    const std::stop_callback stopped(stop, [&] { keeper.tell(this, true); });
    lock.unlock();
    keeper.wait_told(this, until_ns);
    lock.lock();
  }

  std::condition_variable_any changed_;
};

}  // namespace birdseye
