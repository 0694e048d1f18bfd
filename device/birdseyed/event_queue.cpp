#include "device/birdseyed/event_queue.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "drivers/system/monotonic.hpp"

namespace birdseye::device {

namespace {

bool is_frame(const RawEvent& event) {
  return std::holds_alternative<FrameCame>(event);
}

}  // namespace

void EventQueue::push(RawEvent event) {
  {
    const std::lock_guard lock(mutex_);
    if (is_frame(event) && frames_ == kMostFrames) {
      events_.erase(std::find_if(events_.begin(), events_.end(), is_frame));
      --frames_;
      ++frames_dropped_;
    }
    auto* const bytes = std::get_if<TrackerBytes>(&event);
    // What becomes of an instrument is told once, and comes seldom.
    if (events_.size() >= kMostEvents && !std::holds_alternative<InstrumentChanged>(event)) {
      ++others_dropped_;
      tracker_bytes_dropped_ = tracker_bytes_dropped_ || bytes != nullptr;
      return;
    }
    // Records are cut at the hole, as if the line had lost them.
    if (bytes != nullptr && std::exchange(tracker_bytes_dropped_, false)) bytes->chunk.after_line_error = true;
    if (is_frame(event)) ++frames_;
    events_.push_back(std::move(event));
  }
  changed_.notify_one();
}

std::optional<RawEvent> EventQueue::pop(DeviceTime deadline, const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const std::chrono::nanoseconds left(std::max<std::int64_t>(0, (deadline - drivers::now()).ns));
  if (!changed_.wait_for(lock, stop, left, [this] { return !events_.empty(); })) return std::nullopt;
  RawEvent event = std::move(events_.front());
  events_.pop_front();
  if (is_frame(event)) --frames_;
  return event;
}

std::uint64_t EventQueue::frames_dropped() const {
  const std::lock_guard lock(mutex_);
  return frames_dropped_;
}

std::uint64_t EventQueue::others_dropped() const {
  const std::lock_guard lock(mutex_);
  return others_dropped_;
}

}  // namespace birdseye::device
