#include "device/birdseyed/event_queue.hpp"

#include <utility>

namespace birdseye::device {

void EventQueue::push(RawEvent event) {
  if (std::holds_alternative<FrameCame>(event)) {
    events_.push(kFrames, std::move(event));
  } else if (std::holds_alternative<InstrumentChanged>(event)) {
    events_.push(kChanges, std::move(event));
  } else {
    auto* const bytes = std::get_if<TrackerBytes>(&event);
    // Records are cut at the hole, as if the line had lost them. One thread reads the tracker.
    if (bytes != nullptr && tracker_bytes_dropped_.exchange(false)) bytes->chunk.after_line_error = true;
    const bool of_tracker = bytes != nullptr;
    if (!events_.push(kOthers, std::move(event)) && of_tracker) tracker_bytes_dropped_ = true;
  }
}

}  // namespace birdseye::device
