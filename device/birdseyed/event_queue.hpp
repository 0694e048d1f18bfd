#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <vector>

#include "device/birdseyed/raw_event.hpp"
#include "drivers/system/blocking_queue.hpp"

namespace birdseye::device {

/// From the instruments' threads to the one that makes messages. Bounded: of the frames that wait, the oldest goes when
/// there are too many, for what is live matters more than what was; everything else is small and has a bound of
/// minutes. What becomes of instruments comes seldom, and has a bound of its own. What is dropped is counted.
class EventQueue {
 public:
  static constexpr std::size_t kMostFrames = 8, kMostFrameBytes = 96U << 20U;  // 50 MB of 1080p
  static constexpr std::size_t kMostEvents = 16384, kMostEventBytes = 16U << 20U;

  void push(RawEvent event);
  /// The oldest event; empty at the deadline, or once stop is requested.
  std::optional<RawEvent> pop(Deadline deadline, const std::stop_token& stop) { return events_.pop(deadline, stop); }
  [[nodiscard]] std::uint64_t frames_dropped() const { return events_.dropped(kFrames); }
  [[nodiscard]] std::uint64_t others_dropped() const { return events_.dropped(kOthers) + events_.dropped(kChanges); }
  [[nodiscard]] std::vector<QueueFill> fills() const;

 private:
  enum Lane : std::size_t { kFrames, kOthers, kChanges, kLanes };

  BlockingQueue<RawEvent, kLanes> events_{{{{kMostFrames, WhenFull::drop_oldest, kMostFrameBytes},
                                            {kMostEvents, WhenFull::refuse, kMostEventBytes},
                                            {kMostEvents, WhenFull::drop_oldest, kMostEventBytes}}}};
  std::atomic<bool> tracker_bytes_dropped_ = false;
};

}  // namespace birdseye::device
