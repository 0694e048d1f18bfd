#include "device/birdseyed/event_queue.hpp"

#include <utility>

namespace birdseye::device {

void EventQueue::push(RawEvent event) {
  if (std::holds_alternative<FrameCame>(event)) {
    const auto& rgb = std::get<FrameCame>(event).frame.rgb;
    const std::size_t bytes = rgb ? rgb->size() : 0;
    events_.push(kFrames, std::move(event), bytes);
  } else if (std::holds_alternative<InstrumentChanged>(event)) {
    const std::size_t bytes = sizeof event + std::get<InstrumentChanged>(event).text.size();
    events_.push(kChanges, std::move(event), bytes);
  } else {
    auto* const bytes = std::get_if<TrackerBytes>(&event);
    // Records are cut at the hole, as if the line had lost them. One thread reads the tracker.
    if (bytes != nullptr && tracker_bytes_dropped_.exchange(false)) bytes->chunk.after_line_error = true;
    const bool of_tracker = bytes != nullptr;
    const std::size_t size = sizeof event + (of_tracker ? bytes->chunk.bytes.size() : 0);
    if (!events_.push(kOthers, std::move(event), size) && of_tracker) tracker_bytes_dropped_ = true;
  }
}

std::vector<QueueFill> EventQueue::fills() const {
  return {events_.fill(kFrames, "frames from the camera"), events_.fill(kOthers, "events from the instruments"),
          events_.fill(kChanges, "changes of the instruments")};
}

}  // namespace birdseye::device
