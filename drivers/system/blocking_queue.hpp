#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "calibration/base/bounded_queue.hpp"
#include "drivers/system/condition.hpp"

namespace birdseye {

/// A BoundedQueue between threads: any may push, and never waits; one takes, and waits for what comes.
template <typename T, std::size_t kLanes>
class BlockingQueue {
 public:
  using Lanes = typename BoundedQueue<T, kLanes>::Lanes;

  explicit BlockingQueue(const Lanes& lanes) : queue_(lanes) {}

  /// As BoundedQueue::push().
  bool push(std::size_t lane, T value, std::size_t bytes = 0) {
    bool room = false;
    {
      const std::lock_guard lock(mutex_);
      room = queue_.push(lane, std::move(value), bytes);
    }
    changed_.notify_one();
    return room;
  }
  /// The oldest; nothing at the deadline, once stop is requested, or where it is closed and nothing waits.
  std::optional<T> pop(Deadline deadline, const std::stop_token& stop = {}) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, deadline, [this] { return closed_ || !queue_.empty(); });
    return queue_.pop();
  }
  /// The same without a deadline.
  std::optional<T> pop(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, stop, [this] { return closed_ || !queue_.empty(); });
    return queue_.pop();
  }
  /// Nothing more comes. What waits is still to be had.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    changed_.notify_one();
  }
  /// It is closed, and all that came has been taken.
  [[nodiscard]] bool finished() const {
    const std::lock_guard lock(mutex_);
    return closed_ && queue_.empty();
  }
  [[nodiscard]] std::uint64_t dropped(std::size_t lane) const {
    const std::lock_guard lock(mutex_);
    return queue_.dropped(lane);
  }
  /// As BoundedQueue::fill().
  [[nodiscard]] QueueFill fill(std::size_t lane, std::string name) const {
    const std::lock_guard lock(mutex_);
    return queue_.fill(lane, std::move(name));
  }

 private:
  mutable std::mutex mutex_;
  Condition changed_;
  BoundedQueue<T, kLanes> queue_;
  bool closed_ = false;
};

}  // namespace birdseye
