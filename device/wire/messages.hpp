#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/time/pose_history.hpp"

/// What the appliance says to hosts, as OpenIGTLink messages (docs/manual/wire.md). Times are of the appliance's clock.
namespace birdseye::wire {

/// What IMAGE has no room for: travels in a STRING just before it.
struct FrameInfo {
  std::uint64_t sequence = 0;
  DeviceTime acquired;  ///< middle of the exposure
  Duration acquired_sigma;
  DeviceTime arrived;
  PoseAnswer pose;                   ///< of the scope's bird at `acquired`
  std::uint64_t frames_dropped = 0;  ///< so far, by camera and appliance together
};

struct VideoFrame {
  FrameInfo info;
  int width_px = 0, height_px = 0;
  std::shared_ptr<const std::vector<std::uint8_t>> rgb;  ///< rows from the top
};

struct Bird {
  std::string name;
  Transform<Tracker, Sensor> tracker_from_sensor;
};

/// The birds that gave a pose at one measurement.
struct Birds {
  DeviceTime acquired;
  std::vector<Bird> birds;
};

struct Status {
  bool ok = true;
  std::string text;
};

struct Health {
  double tracker_rate_hz = 0;
  std::uint64_t measurements = 0, phase_errors = 0, senseless_records = 0;
  std::uint64_t frames = 0, frames_dropped = 0, messages_shed = 0;
};

using Event = std::variant<VideoFrame, Birds, Status, Health>;

/// One or more whole messages, to be sent together or not at all.
using Packet = std::shared_ptr<const std::vector<std::uint8_t>>;
Packet pack(const VideoFrame& frame);
Packet pack(const Birds& birds);
Packet pack(const Status& status, DeviceTime time);
Packet pack(const Health& health, DeviceTime time);

inline constexpr std::size_t kHeaderBytes = 58;
inline constexpr std::uint64_t kLargestBody = 64U << 20U;

/// Body size by a message's header; refuses what is no header and bodies over kLargestBody.
Result<std::uint64_t> body_bytes(std::span<const std::uint8_t> header);

/// Puts messages back together: a FrameInfo is held until its image comes. Messages that are not ours are passed over.
class Unpacker {
 public:
  /// message: header and body. Empty where it completes nothing.
  Result<std::optional<Event>> push(std::span<const std::uint8_t> message);

 private:
  std::optional<FrameInfo> info_;
};

}  // namespace birdseye::wire
