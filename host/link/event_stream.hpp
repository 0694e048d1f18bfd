#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "device/wire/client.hpp"
#include "drivers/system/blocking_queue.hpp"
#include "drivers/system/thread.hpp"
#include "host/link/drops.hpp"
#include "host/link/event_source.hpp"

namespace birdseye::host {

/// How this machine's clock stands to the appliance's: one moment on both.
struct ClockGap {
  DeviceTime at;
  RelatedTime<HostTime> host;

  /// Of times near that moment, between which and it no clock drifts by anything that counts.
  [[nodiscard]] HostTime host_from_device(DeviceTime time) const { return host.time + (time - at); }
};

/// When a frame was exposed, or a pose measured; empty for other events.
std::optional<DeviceTime> acquired_of(const wire::Event& event);

/// Reads the wire on a thread of its own, so that work on one frame does not make the appliance shed the next. Bounded:
/// past most_frames waiting, the oldest frame is dropped; the frames' own sequence numbers show the gap. Poses have a
/// bound of their own, and so has what is seldom (Pedal, Calibration, Status ...): neither costs a pedal press.
class EventStream : public EventSource {
 public:
  EventStream(std::unique_ptr<wire::Client> client, std::size_t most_frames);

  /// The next event; empty at the deadline; an error once the appliance has gone and all its events are taken.
  Result<std::optional<wire::Event>> next(Deadline deadline) override;
  /// By the newest frame or pose; empty until that is known.
  [[nodiscard]] std::optional<ClockGap> host_from_device() const;
  /// For a server that is no appliance: what it is, and which of its messages are passed over. Empty for an appliance.
  [[nodiscard]] std::string peer_words() const;
  /// Whether what goes over the wire can be read and changed on its way.
  [[nodiscard]] bool is_plain() const { return plain_; }
  /// By what name the machine that answers is known here, by its key; empty: none was asked for.
  [[nodiscard]] const std::string& machine() const { return machine_; }
  /// What nobody took in time.
  [[nodiscard]] Drops drops() const {
    return {events_.dropped(kFrames), events_.dropped(kPoses) + events_.dropped(kOthers)};
  }
  /// Of what nobody has taken yet.
  [[nodiscard]] std::vector<QueueFill> fills() const;

 private:
  enum Lane : std::size_t { kFrames, kPoses, kOthers, kLanes };

  void read(const std::stop_token& stop);
  static Lane lane_of(const wire::Event& event);
  [[nodiscard]] std::optional<ClockGap> gap_at(const wire::Event& event) const;

  /// Other events than frames are small and come a hundred times a second: this bound holds a minute of them.
  static constexpr std::size_t kMostOthers = 8192, kMostOtherBytes = 64U << 20U;
  static constexpr std::size_t kMostFrameBytes = 768U << 20U;  ///< two seconds of 1080p at 60 Hz

  std::unique_ptr<wire::Client> client_;
  bool plain_;
  std::string machine_;
  BlockingQueue<wire::Event, kLanes> events_;
  mutable std::mutex mutex_;  // of what follows
  std::optional<Error> ended_;
  std::optional<ClockGap> gap_;
  std::string peer_words_;
  OwnedThread thread_;
};

}  // namespace birdseye::host
