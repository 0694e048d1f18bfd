#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

namespace birdseye {

/// What gives way where a lane is full.
enum class WhenFull {
  drop_oldest,  ///< the oldest that waits in the lane: of what is live, the newest counts
  refuse,       ///< what comes: of what is a record, the beginning counts
};

struct QueueLane {
  std::size_t capacity = 0;
  WhenFull when_full = WhenFull::drop_oldest;
};

/// What waits, first in, first out. It waits in lanes, each with its own bound, so that much of one kind never pushes
/// out what there is of another; it is taken in the order in which it came, whatever its lane. Nothing is lost
/// uncounted. For one thread; drivers/system/blocking_queue.hpp is for several.
template <typename T, std::size_t kLanes>
class BoundedQueue {
 public:
  using Lanes = std::array<QueueLane, kLanes>;

  explicit BoundedQueue(const Lanes& lanes) : lanes_(lanes) {}

  /// False: the lane was full, and one was lost, as its rule says.
  bool push(std::size_t lane, T value) {
    const bool room = waiting_[lane].size() < lanes_[lane].capacity;
    if (!room) ++dropped_[lane];
    if (!room && lanes_[lane].when_full == WhenFull::refuse) return false;
    waiting_[lane].push_back({turns_++, std::move(value)});
    if (!room) waiting_[lane].pop_front();
    return room;
  }
  /// The oldest of all; nothing where none waits.
  std::optional<T> pop() {
    std::deque<Waiting>* oldest = nullptr;
    for (auto& lane : waiting_) {
      if (!lane.empty() && (oldest == nullptr || lane.front().turn < oldest->front().turn)) oldest = &lane;
    }
    if (oldest == nullptr) return std::nullopt;
    std::optional<T> value = std::move(oldest->front().value);
    oldest->pop_front();
    return value;
  }
  [[nodiscard]] bool empty() const {
    for (const auto& lane : waiting_) {
      if (!lane.empty()) return false;
    }
    return true;
  }
  /// How many a lane has lost so far.
  [[nodiscard]] std::uint64_t dropped(std::size_t lane) const { return dropped_[lane]; }

 private:
  struct Waiting {
    std::uint64_t turn;
    T value;
  };

  Lanes lanes_;
  std::array<std::deque<Waiting>, kLanes> waiting_;
  std::array<std::uint64_t, kLanes> dropped_{};
  std::uint64_t turns_ = 0;
};

}  // namespace birdseye
