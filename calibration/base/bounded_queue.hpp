#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "calibration/base/queue_fill.hpp"

namespace birdseye {

/// What gives way where a lane is full.
enum class WhenFull {
  drop_oldest,  ///< the oldest that waits in the lane: of what is live, the newest counts
  refuse,       ///< what comes: of what is a record, the beginning counts
};

struct QueueLane {
  std::size_t capacity = 0;
  WhenFull when_full = WhenFull::drop_oldest;
  std::size_t bytes = SIZE_MAX;  ///< that its values may have together
};

/// What waits, first in, first out. It waits in lanes, each with its own bound, so that much of one kind never pushes
/// out what there is of another; it is taken in the order in which it came, whatever its lane. Nothing is lost
/// uncounted. A lane's bound is in values, and in bytes where values differ in size. For one thread;
/// drivers/system/blocking_queue.hpp is for several.
template <typename T, std::size_t kLanes>
class BoundedQueue {
 public:
  using Lanes = std::array<QueueLane, kLanes>;

  explicit BoundedQueue(const Lanes& lanes) : lanes_(lanes) {}

  /// bytes: of the value. False: the lane was full, and one was lost, or as many as leave room, as its rule says.
  bool push(std::size_t lane, T value, std::size_t bytes = 0) {
    const bool room = has_room(lane, waiting_[lane].size() + 1, bytes);
    if (!room && lanes_[lane].when_full == WhenFull::refuse) {
      ++dropped_[lane];
      return false;
    }
    waiting_[lane].push_back({turns_++, bytes, std::move(value)});
    held_[lane] += bytes;
    while (!has_room(lane, waiting_[lane].size(), 0)) {
      (void)take(lane);
      ++dropped_[lane];
    }
    return room;
  }
  /// The oldest of all; nothing where none waits.
  std::optional<T> pop() {
    std::optional<std::size_t> oldest;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const auto& of_lane = waiting_[lane];
      if (!of_lane.empty() && (!oldest || of_lane.front().turn < waiting_[*oldest].front().turn)) oldest = lane;
    }
    if (!oldest) return std::nullopt;
    return take(*oldest);
  }
  [[nodiscard]] bool empty() const {
    for (const auto& lane : waiting_) {
      if (!lane.empty()) return false;
    }
    return true;
  }
  /// How many a lane has lost so far.
  [[nodiscard]] std::uint64_t dropped(std::size_t lane) const { return dropped_[lane]; }
  /// What waits is counted anew, so that a count that went wrong shows. name: of the queue.
  [[nodiscard]] QueueFill fill(std::size_t lane, std::string name) const {
    QueueFill out{std::move(name), waiting_[lane].size(), lanes_[lane].capacity, 0, lanes_[lane].bytes};
    for (const Waiting& one : waiting_[lane]) out.bytes += one.bytes;
    return out;
  }

 private:
  struct Waiting {
    std::uint64_t turn;
    std::size_t bytes;
    T value;
  };

  [[nodiscard]] bool has_room(std::size_t lane, std::size_t values, std::size_t more_bytes) const {
    const QueueLane& bound = lanes_[lane];
    return values <= bound.capacity && held_[lane] <= bound.bytes && more_bytes <= bound.bytes - held_[lane];
  }
  T take(std::size_t lane) {
    Waiting& first = waiting_[lane].front();
    T value = std::move(first.value);
    held_[lane] -= first.bytes;
    waiting_[lane].pop_front();
    return value;
  }

  Lanes lanes_;
  std::array<std::deque<Waiting>, kLanes> waiting_;
  std::array<std::size_t, kLanes> held_{};  ///< bytes
  std::array<std::uint64_t, kLanes> dropped_{};
  std::uint64_t turns_ = 0;
};

}  // namespace birdseye
