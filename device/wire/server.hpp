#pragma once

#include <atomic>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/queue_fill.hpp"
#include "calibration/time/rate_limit.hpp"
#include "device/wire/client_link.hpp"
#include "device/wire/host_limits.hpp"
#include "device/wire/link.hpp"
#include "device/wire/tcp_link.hpp"
#include "drivers/system/thread.hpp"

namespace birdseye::wire {

/// Sends packets to every client that is connected, and answers what they ask (docs/manual/wire.md). A client that does
/// not keep up loses the oldest packets that wait for it (never parts of one), not the others; one that takes nothing
/// for ten seconds, or does not speak the protocol, is disconnected; one that asks without end is answered at a bounded
/// rate.
class Server {
 public:
  /// port: 0 takes any that is free. For a port in use the error names the port and the setting.
  /// Without an admission, only programs of this machine are let in.
  static Result<std::unique_ptr<Server>> listen(const std::string& bind_address, int port, Admission admission = {});
  /// The same over whatever links a listener gives.
  static std::unique_ptr<Server> over(std::unique_ptr<Listener> listener);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  void publish(const Packet& packet);
  [[nodiscard]] int port() const { return listener_->port(); }

  struct Counters {
    std::uint64_t clients = 0, messages_shed = 0, requests_refused = 0;
    std::uint64_t clients_shed = 0;  ///< put out for taking nothing or holding too much, or refused for want of room
    // Since they were last taken; 0: there was none.
    double latency_ms_p99_tracker = 0, latency_ms_p99_tracker_beside_frames = 0, latency_ms_p99_frame = 0;
  };
  Counters take_counters();
  [[nodiscard]] std::size_t clients() const { return clients_count_; }
  /// Of what waits for the clients, as it was when packets were last given to them.
  [[nodiscard]] std::vector<QueueFill> fills();
  /// Whether a connected client wants the camera's controls held.
  [[nodiscard]] bool camera_locked() const { return camera_locked_; }

 private:
  explicit Server(std::unique_ptr<Listener> listener);
  void run(const std::stop_token& stop);
  void accept_one();
  /// Whether there is room for it. Some places are kept from machines that are not known, and where all are taken such
  /// a machine gives one up to one that is known. Otherwise the host that holds most gives one up to a host that then
  /// holds no more than it.
  bool make_room(const Link& link);
  /// Gives published packets to the clients; returns whether there were frames among them.
  bool distribute();
  void offer(ClientLink& client, const Packet& packet) { messages_shed_ += client.offer(packet); }
  std::list<ClientLink>::iterator put_out(std::list<ClientLink>::iterator client);
  /// Keeps the frames that all clients hold within one bound.
  void bound_frames();
  /// Bytes of all frames held, each frame counted once however many clients hold it.
  [[nodiscard]] std::size_t frame_bytes_held() const;
  void note_fills();
  /// Sends to a client and reads from it. False: the client is to be disconnected.
  bool serve(ClientLink& client, const LinkWatch& told);
  void answer(ClientLink& client, const Request& request);
  void take_lock(ClientLink& client, const CameraLock& lock);

  std::unique_ptr<Listener> listener_;
  std::atomic<std::size_t> clients_count_ = 0;
  std::atomic<bool> camera_locked_ = false;
  std::atomic<std::uint64_t> messages_shed_ = 0, clients_shed_ = 0, requests_refused_ = 0;
  std::mutex mutex_;
  PacketQueue inbox_;  ///< published, not yet distributed
  QueueFill frames_fill_, small_fill_;
  Latencies latencies_;
  std::list<ClientLink> clients_;  ///< of the server's thread alone, as is all that follows
  // A new client gets these at once.
  std::optional<Packet> last_status_, last_calibration_, last_volume_;
  HostLimits requests_{Duration{2'500'000}, 800};
  RateLimit accepts_{Duration{200'000}, 64};  ///< so that connections without end leave the thread time
  OwnedThread thread_;
};

}  // namespace birdseye::wire
