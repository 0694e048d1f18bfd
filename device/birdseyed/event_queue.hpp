#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>
#include <stop_token>

#include "device/birdseyed/raw_event.hpp"

namespace birdseye::device {

/// From the instruments' threads to the one that makes messages. Bounded: when too many frames wait, the oldest goes,
/// for what is live matters more than what was. Everything else is small and may wait for minutes; changes of
/// instruments are never dropped. What is dropped is counted.
class EventQueue {
 public:
  static constexpr std::size_t kMostFrames = 8;  // 50 MB of 1080p
  static constexpr std::size_t kMostEvents = 16384;

  void push(RawEvent event);
  /// The oldest event; empty at the deadline, or once stop is requested.
  std::optional<RawEvent> pop(DeviceTime deadline, const std::stop_token& stop);
  [[nodiscard]] std::uint64_t frames_dropped() const;
  [[nodiscard]] std::uint64_t others_dropped() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  std::deque<RawEvent> events_;
  std::size_t frames_ = 0;
  std::uint64_t frames_dropped_ = 0, others_dropped_ = 0;
  bool tracker_bytes_dropped_ = false;
};

}  // namespace birdseye::device
