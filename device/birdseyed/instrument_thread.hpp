#pragma once

#include <atomic>
#include <functional>

#include "device/birdseyed/event_queue.hpp"

namespace birdseye::device {

/// What an instrument's thread shares with the appliance: where its events go, and a sign of life for the watchdog.
class InstrumentPost {
 public:
  InstrumentPost(Instrument instrument, EventQueue& queue) : instrument_(instrument), queue_(queue) {}

  [[nodiscard]] Instrument instrument() const { return instrument_; }
  void push(RawEvent event) { queue_.push(std::move(event)); }
  /// Tells a change of state, once: the same again is not news.
  void tell(InstrumentChanged changed);
  void alive();
  [[nodiscard]] DeviceTime last_alive() const { return {alive_ns_}; }

 private:
  Instrument instrument_;
  EventQueue& queue_;
  std::atomic<std::int64_t> alive_ns_ = 0;
  InstrumentState state_ = InstrumentState::unused;
  std::string text_;
};

inline constexpr Duration kPatience = Duration::from_ms(100);   ///< within which a thread sees that it shall stop
inline constexpr Duration kLookAgain = Duration::from_ms(400);  ///< for an instrument that is not there

}  // namespace birdseye::device
