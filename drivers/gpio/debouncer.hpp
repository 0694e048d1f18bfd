#pragma once

#include <cstdint>
#include <optional>

#include "calibration/time/clock.hpp"

namespace birdseye::drivers {

/// A contact that bounces: edges in, presses and releases out. A change counts once the contact has stayed for `hold`.
/// The time of the change is that of the edge that began it, so that neither bounces nor the wait make it late. A spike
/// shorter than `hold` is no change. Pure: time comes with the edges.
class Debouncer {
 public:
  struct Change {
    bool active = false;
    DeviceTime at;
  };

  Debouncer(Duration hold, bool active) : hold_(hold), settled_(active), level_(active) {}

  /// Edges in the order of their times. Two to the same level mean that one between them was lost.
  void push(bool active, DeviceTime at);
  /// The change that has lasted long enough by now. Must be asked before a later edge is pushed.
  std::optional<Change> settle(DeviceTime now);
  /// When to ask next; empty while nothing changes.
  [[nodiscard]] std::optional<DeviceTime> due() const;
  /// Whether the contact is closed, by the last edge.
  [[nodiscard]] bool level() const { return level_; }
  /// Edges that made no change.
  [[nodiscard]] std::uint64_t bounces() const { return bounces_; }

 private:
  Duration hold_;
  bool settled_, level_;
  DeviceTime began_;  // the first edge of this burst: the contact had been still before it
  DeviceTime last_edge_;
  std::uint64_t edges_ = 0;  // of this burst
  std::uint64_t bounces_ = 0;
};

}  // namespace birdseye::drivers
