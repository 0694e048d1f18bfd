#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/time/rate_limit.hpp"
#include "device/wire/latency_log.hpp"
#include "device/wire/link.hpp"
#include "device/wire/packet_queue.hpp"
#include "device/wire/request.hpp"

namespace birdseye::wire {

/// From the last byte in to the last byte handed to the operating system.
struct Latencies {
  LatencyLog tracker;  ///< of clients that take no frames
  LatencyLog
      tracker_beside_frames;  ///< of clients that take frames too: a pose waits while a frame before it is on its way
  LatencyLog frame;
};

/// The server's end of one client: the packets that wait for it, and the request that it has begun. Used by one thread.
class ClientLink {
 public:
  /// of_host: what all clients of its machine may ask together; null: each may ask by itself.
  explicit ClientLink(std::unique_ptr<Link> link, std::shared_ptr<RateLimit> of_host = {});

  [[nodiscard]] Link& link() const { return *link_; }
  [[nodiscard]] const std::string& host() const { return host_; }
  [[nodiscard]] bool is_known() const { return link_->is_known(); }
  /// Whether the client has asked no more than a client needs. Until it may ask again, receive() is not to be called,
  /// and what the client sends waits with the operating systems.
  [[nodiscard]] bool may_ask() const {
    const DeviceTime now = device_now();
    return now >= requests_.free_at() && (!of_host_ || now >= of_host_->free_at());
  }
  [[nodiscard]] bool wants_to_write() const { return sending_ || !waiting_.empty(); }
  /// Queues a packet if the client wants its kind. Returns how many older packets were dropped for it.
  std::size_t offer(const Packet& packet);
  /// Hands one slice to the operating system, so that a frame to one client does not keep the others waiting; small
  /// packets go before frames that have not begun. A packet has begun when its first byte was taken; from then on it is
  /// sent whole. False: the client has gone.
  bool send_some(Latencies& latencies);
  /// The requests that have come from the client. An error: the client has gone, or does not speak the protocol.
  Result<std::vector<Request>> receive();
  /// Changes what this client gets, as its request says.
  void take(const Subscription& subscription);
  void take(const TrackingRequest& request);
  void take(const CameraLock& lock) { locks_camera_ = lock.on; }
  [[nodiscard]] bool locks_camera() const { return locks_camera_; }
  /// Whether the client has taken nothing for long although there was something, or has left a message of its own half
  /// sent.
  [[nodiscard]] bool stuck() const;

  [[nodiscard]] std::size_t frames_waiting() const { return waiting_.frames().size(); }
  [[nodiscard]] std::size_t small_waiting() const { return waiting_.small().size(); }
  std::size_t shed_frame() { return waiting_.shed_frame(); }
  [[nodiscard]] bool sends_frame() const { return sending_ && sending_->kind == Packet::Kind::frame; }
  [[nodiscard]] DeviceTime last_progress() const { return progress_; }
  /// Appends the pixels of every frame that waits or is being sent.
  void add_pixels_to(std::vector<const std::vector<std::uint8_t>*>& pixels) const;

 private:
  [[nodiscard]] bool wants(const Packet& packet);
  void finish(Latencies& latencies);

  std::unique_ptr<Link> link_;
  std::string host_;
  RequestReader reader_;
  Subscription subscription_;
  bool locks_camera_ = false;
  Duration tracking_interval_{0};
  DeviceTime tracking_sent_;
  PacketQueue waiting_;
  std::optional<Packet> sending_;  ///< begun
  std::size_t sent_ = 0;           ///< bytes of sending_
  DeviceTime progress_, asking_since_;
  RateLimit requests_;
  std::shared_ptr<RateLimit> of_host_;
};

}  // namespace birdseye::wire
