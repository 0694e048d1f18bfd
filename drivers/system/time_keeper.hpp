#pragma once

#include <cstdint>
#include <functional>
#include <memory>

namespace birdseye {

/// Tells the time, and lets threads start and wait, in place of the machine. Only a simulator puts one there: the same
/// drivers, appliance and host then run in its time. All that this folder offers to read a clock, to sleep, to wait for
/// a condition and to own a thread asks it first.
class TimeKeeper {
 public:
  virtual ~TimeKeeper() = default;

  [[nodiscard]] virtual std::int64_t monotonic_ns() = 0;
  /// Of the time of day, since 1970, UTC.
  [[nodiscard]] virtual std::int64_t realtime_ns() = 0;
  /// The calling thread goes on at that time.
  virtual void sleep_until(std::int64_t monotonic_ns) = 0;
  /// The calling thread goes on once somebody calls tell() of the same thing, or at that time.
  virtual void wait_told(const void* thing, std::int64_t until_ns) = 0;
  /// Those that wait for the thing, or one of them, may go on. The caller goes on first.
  virtual void tell(const void* thing, bool all) = 0;

  class Thread {
   public:
    virtual ~Thread() = default;
    /// Waits until its work is done.
    virtual void join() = 0;
  };
  virtual std::shared_ptr<Thread> start(std::function<void()> work) = 0;

  /// For the calling thread of the machine. Null: its time is the machine's.
  static TimeKeeper* present();
  /// The same. keeper: outlives its being here. Null: none from now on.
  static void put(TimeKeeper* keeper);
};

}  // namespace birdseye
