#pragma once

#include <deque>
#include <optional>

#include "device/wire/latency_log.hpp"
#include "device/wire/packet.hpp"
#include "device/wire/request.hpp"

namespace birdseye::wire {

/// CLOCK_MONOTONIC.
DeviceTime monotonic_now();

/// From the last byte in to the last byte handed to the operating system.
struct Latencies {
  LatencyLog tracker;                ///< of clients that take no frames
  LatencyLog tracker_beside_frames;  ///< of those that do: a pose waits while a frame before it is on its way
  LatencyLog frame;
};

/// One client's end at the server: what waits to be sent to it, and what it has begun to ask. Used by one thread.
class ClientLink {
 public:
  explicit ClientLink(int fd);  ///< a connected, non-blocking socket, which is closed with this object
  ~ClientLink();
  ClientLink(const ClientLink&) = delete;
  ClientLink& operator=(const ClientLink&) = delete;

  [[nodiscard]] int fd() const { return fd_; }
  [[nodiscard]] bool wants_to_write() const { return sending_ || !small_.empty() || !frames_.empty(); }
  /// Queues a packet, if the client wants its kind; false where its queue is full and the packet is lost to it.
  bool offer(const Packet& packet);
  /// Hands one slice to the operating system, so that a frame to one client does not keep the others waiting; small
  /// packets go before frames that have not begun. False: the client has gone.
  bool send_some(Latencies& latencies);
  /// What the client asked. An error: it has gone, or it does not speak the protocol.
  Result<std::vector<Request>> receive();
  /// Takes what a request changes about what this client gets.
  void take(const Subscription& subscription) { subscription_ = subscription; }
  void take(const TrackingRequest& request);
  /// It has taken nothing for long although there was something, or left a message of its own half sent.
  [[nodiscard]] bool stuck() const;

 private:
  [[nodiscard]] bool wants(const Packet& packet);

  int fd_;
  RequestReader reader_;
  Subscription subscription_;
  Duration tracking_interval_{0};
  DeviceTime tracking_sent_;
  std::deque<Packet> small_, frames_;
  std::size_t queued_bytes_ = 0;
  std::optional<Packet> sending_;
  std::size_t sent_ = 0;  ///< bytes of sending_
  DeviceTime progress_, asking_since_;
};

}  // namespace birdseye::wire
