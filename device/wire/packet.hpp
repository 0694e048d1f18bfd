#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "device/wire/messages.hpp"

namespace birdseye::wire {

/// One or more whole messages, to be sent together or not at all. The pixels of a frame or volume are not copied into
/// it: they follow the head.
struct Packet {
  enum class Kind { status, calibration, tracking, frame, volume, other };
  Kind kind = Kind::other;
  std::shared_ptr<const std::vector<std::uint8_t>> head;
  std::shared_ptr<const std::vector<std::uint8_t>> pixels;  ///< null for all but frames and volumes
  DeviceTime arrived;  ///< when the last byte came of what the packet tells; 0: it tells of nothing that came

  [[nodiscard]] std::size_t size() const { return head->size() + (pixels ? pixels->size() : 0); }
  /// Head and pixels as one run of bytes, for looking at them.
  [[nodiscard]] std::vector<std::uint8_t> bytes() const;
};

Packet pack(const VideoFrame& frame);
/// TDATA; with transforms also a TRANSFORM for each bird behind it, in the same packet, so that a client gets both or
/// neither. arrived: of the measurement's last byte.
Packet pack(const Birds& birds, DeviceTime arrived = {}, bool transforms = false);
/// The device of a bird's TRANSFORMs: "scope" gives "ScopeToTracker". Of a long name what the protocol has room for.
std::string transform_device(const std::string& bird);
Packet pack(const Doubt& doubt);
Packet pack(const ClockChange& change);
Packet pack(const Pedal& pedal);
Packet pack(const Status& status, DeviceTime time, const char* device = kStatusDevice);
Packet pack(const Health& health, DeviceTime time);
Packet pack(const CameraControls& controls, DeviceTime time);
Packet pack(const Calibration& calibration, DeviceTime time);

/// A TRANSFORM for other programs: by what they call it, mm.
struct PublishedTransform {
  std::string name;
  Eigen::Matrix4d matrix;
  DeviceTime time;
};
/// An IMAGE of 16-bit voxels for other programs, in their frame, RAS.
struct PublishedVolume {
  std::string name;
  std::array<int, 3> size{};
  Eigen::Affine3d ras_from_voxel = Eigen::Affine3d::Identity();
  std::shared_ptr<const std::vector<std::uint8_t>> voxels;  ///< x fastest, two bytes each, the lower first
  DeviceTime time;
};
Packet pack(const PublishedTransform& transform);
Packet pack(const PublishedVolume& volume);

/// A client's questions and the answers to them; times are ns of each side's own clock.
struct ClockPing {
  std::int64_t host_sent_ns = 0;
};
struct ClockPong {
  std::int64_t host_sent_ns = 0;
  DeviceTime received, sent;
};
struct Subscription {
  bool frames = true, tracking = true;
};
Packet pack(const ClockPing& ping);
Packet pack(const ClockPong& pong);
/// Hold the camera's exposure, gain, white balance and focus for as long as this client is there, or until it lets go.
struct CameraLock {
  bool on = false;
};
Packet pack(const Subscription& subscription);
Packet pack(const CameraLock& lock);
/// STT_TDATA: poses are wanted, as often as there are any.
Packet pack_tracking_request();
/// GET_STATUS with a header of version 2. PLUS answers each client by the highest version that it has heard of it, and
/// only from version 2 on says with a pose whether it is valid.
Packet pack_status_request();
/// The answer to STT_TDATA and STP_TDATA: RTS_TDATA, with the status 0 (done) or 1.
Packet pack_tracking_reply(bool done);

}  // namespace birdseye::wire
