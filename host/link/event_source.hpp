#pragma once

#include <optional>

#include "calibration/base/result.hpp"
#include "device/wire/messages.hpp"
#include "drivers/system/clock.hpp"

namespace birdseye::host {

/// Where a session's events come from, in order: an appliance that runs (EventStream), or a recording.
class EventSource {
 public:
  virtual ~EventSource() = default;
  /// The next event; empty at the deadline; Errc::disconnected once the source has ended and all its events are taken.
  virtual Result<std::optional<wire::Event>> next(Deadline deadline) = 0;
};

}  // namespace birdseye::host
