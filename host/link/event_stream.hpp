#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "device/wire/client.hpp"
#include "host/link/event_source.hpp"

namespace birdseye::host {

/// This machine's CLOCK_MONOTONIC less the appliance's, with a sigma.
struct ClockGap {
  Duration gap, sigma;
};

/// Reads the wire on a thread of its own, so that work on one frame does not make the appliance shed the next. Bounded:
/// past most_frames waiting, the oldest frame is dropped; the frames' own sequence numbers show the gap.
class EventStream : public EventSource {
 public:
  EventStream(std::unique_ptr<wire::Client> client, std::size_t most_frames);

  /// The next event; empty at the deadline; an error once the appliance has gone and all its events are taken.
  Result<std::optional<wire::Event>> next(wire::Client::Clock::time_point deadline) override;
  /// By how much this machine's clock is ahead of the appliance's, by the newest frame; empty until that is known.
  [[nodiscard]] std::optional<ClockGap> host_from_device() const;
  /// For a server that is no appliance: what it is, and which of its messages are passed over. Empty for an appliance.
  [[nodiscard]] std::string peer_words() const;

 private:
  void read(const std::stop_token& stop);
  void keep(wire::Event event);
  [[nodiscard]] std::optional<ClockGap> gap_at(const wire::Event& event) const;

  /// Other events than frames are small and come a hundred times a second: this bound holds a minute of them.
  static constexpr std::size_t kMostOthers = 8192;

  std::unique_ptr<wire::Client> client_;
  std::size_t most_frames_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<wire::Event> events_;
  std::size_t frames_ = 0;
  std::optional<Error> ended_;
  std::optional<ClockGap> gap_;
  std::string peer_words_;
  std::jthread thread_;
};

}  // namespace birdseye::host
