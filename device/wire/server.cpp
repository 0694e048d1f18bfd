#include "device/wire/server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <iterator>
#include <utility>

namespace birdseye::wire {

namespace {

constexpr std::size_t kMostFrameBytesHeld = 96U << 20U;  // fifteen frames of 1080p
constexpr std::size_t kMostClients = 16;
constexpr int kMostUnsentBytes = 256 << 10;

}  // namespace

bool is_address(const std::string& text) {
  in_addr address{};
  return ::inet_pton(AF_INET, text.c_str(), &address) == 1;
}

Result<std::unique_ptr<Server>> Server::listen(const std::string& bind_address, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  if (::inet_pton(AF_INET, bind_address.c_str(), &address.sin_addr) != 1) {
    return Error{Errc::bad_value, fmt::format("[wire] bind \"{}\": give an IPv4 address, as 127.0.0.1", bind_address)};
  }
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  if (fd >= 0) ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  socklen_t size = sizeof address;
  if (fd < 0 || ::bind(fd, reinterpret_cast<const sockaddr*>(&address), size) != 0 || ::listen(fd, 8) != 0 ||
      ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const int failed = errno;
    if (fd >= 0) ::close(fd);
    if (failed == EADDRINUSE) {
      return Error{
          Errc::in_use,
          fmt::format("[wire] port {} on {} is in use; stop the other program or choose another", port, bind_address),
          failed};
    }
    return Error{Errc::bad_value,
                 fmt::format("[wire] bind {} port {}: this machine cannot listen there", bind_address, port), failed};
  }
  return std::unique_ptr<Server>(new Server(fd, ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), ntohs(address.sin_port)));
}

Server::Server(int fd, int wake_fd, int port) : fd_(fd), wake_fd_(wake_fd), port_(port) {
  thread_ = std::jthread([this](const std::stop_token& stop) { run(stop); });
}

Server::~Server() {
  thread_.request_stop();
  wake();
  if (thread_.joinable()) thread_.join();
  ::close(fd_);
  ::close(wake_fd_);
}

void Server::wake() const {
  const std::uint64_t one = 1;
  (void)!::write(wake_fd_, &one, sizeof one);
}

void Server::publish(const Packet& packet) {
  {
    const std::lock_guard lock(mutex_);
    messages_shed_ += inbox_.push(packet);
  }
  wake();
}

Server::Counters Server::take_counters() {
  Counters counters{clients_count_, messages_shed_, requests_refused_, clients_shed_, 0, 0, 0};
  counters.latency_ms_p99_tracker = latencies_.tracker.take_p99_ms();
  counters.latency_ms_p99_tracker_beside_frames = latencies_.tracker_beside_frames.take_p99_ms();
  counters.latency_ms_p99_frame = latencies_.frame.take_p99_ms();
  return counters;
}

void Server::accept_one() {
  const int fd = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) return;
  if (clients_.size() >= kMostClients) {
    ++clients_shed_;  // before the client can know
    ::close(fd);
    return;
  }
  const int on = 1;
  ::setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  // What the kernel holds unsent is no longer ours to shed, and a pose waits behind it.
  ::setsockopt(fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &kMostUnsentBytes, sizeof kMostUnsentBytes);
  clients_.emplace_back(fd);
  if (last_status_) offer(clients_.back(), *last_status_);
  if (last_calibration_) offer(clients_.back(), *last_calibration_);
  if (last_volume_) offer(clients_.back(), *last_volume_);
  ++clients_count_;
}

bool Server::distribute() {
  PacketQueue packets;
  {
    const std::lock_guard lock(mutex_);
    std::swap(packets, inbox_);
  }
  const bool frames = !packets.frames().empty();
  while (!packets.empty()) {
    const Packet packet = packets.pop();
    if (packet.kind == Packet::Kind::status) last_status_ = packet;
    if (packet.kind == Packet::Kind::calibration) last_calibration_ = packet;
    if (packet.kind == Packet::Kind::volume) last_volume_ = packet;
    for (ClientLink& client : clients_) offer(client, packet);
  }
  return frames;
}

std::size_t Server::frame_bytes_held() const {
  std::vector<const std::vector<std::uint8_t>*> pixels;
  for (const ClientLink& client : clients_) client.add_pixels_to(pixels);
  std::sort(pixels.begin(), pixels.end());
  pixels.erase(std::unique(pixels.begin(), pixels.end()), pixels.end());
  std::size_t bytes = 0;
  for (const auto* of_one : pixels) bytes += of_one->size();
  return bytes;
}

std::list<ClientLink>::iterator Server::put_out(std::list<ClientLink>::iterator client) {
  --clients_count_;
  return clients_.erase(client);
}

/// What waits goes first, but never the newest frame, which is the same for all. A frame that has begun goes only with
/// its client: with the one that has taken nothing for the longest time.
void Server::bound_frames() {
  while (frame_bytes_held() > kMostFrameBytesHeld) {
    const auto most = std::ranges::max_element(clients_, {}, &ClientLink::frames_waiting);
    if (most->frames_waiting() > 1) {
      messages_shed_ += most->shed_frame();
      continue;
    }
    auto stuck = clients_.end();
    for (auto client = clients_.begin(); client != clients_.end(); ++client) {
      const bool longer = stuck == clients_.end() || client->last_progress() < stuck->last_progress();
      if (client->sends_frame() && longer) stuck = client;
    }
    if (stuck == clients_.end()) return;
    put_out(stuck);
    ++clients_shed_;
  }
}

void Server::answer(ClientLink& client, const Request& request) {
  if (const auto* ping = std::get_if<ClockPing>(&request)) {
    const DeviceTime now = monotonic_now();
    offer(client, pack(ClockPong{ping->host_sent_ns, now, now}));
  } else if (const auto* subscription = std::get_if<Subscription>(&request)) {
    client.take(*subscription);
  } else if (const auto* lock = std::get_if<CameraLock>(&request)) {
    client.take(*lock);
  } else if (const auto* tracking = std::get_if<TrackingRequest>(&request)) {
    client.take(*tracking);
    offer(client, pack_tracking_reply(true));
  } else if (std::holds_alternative<StatusRequest>(request)) {
    if (last_status_) offer(client, *last_status_);
  } else if (std::holds_alternative<DamagedRequest>(request)) {
    ++requests_refused_;
  }
}

bool Server::serve(ClientLink& client, short events) {
  if ((events & (POLLERR | POLLNVAL)) != 0) return false;
  if ((events & (POLLIN | POLLHUP)) != 0) {
    const auto requests = client.receive();
    if (!requests) {
      if (requests.error().code == Errc::bad_format) ++requests_refused_;
      return false;
    }
    for (const Request& request : *requests) answer(client, request);
  }
  if (client.stuck()) {
    ++clients_shed_;
    return false;
  }
  return client.send_some(latencies_);
}

void Server::run(const std::stop_token& stop) {
  std::vector<pollfd> entries;
  while (!stop.stop_requested()) {
    entries.assign({{fd_, POLLIN, 0}, {wake_fd_, POLLIN, 0}});
    for (const ClientLink& client : clients_)
      entries.push_back({client.fd(), static_cast<short>(client.wants_to_write() ? POLLIN | POLLOUT : POLLIN), 0});
    if (::poll(entries.data(), entries.size(), 200) < 0) continue;
    if ((entries[1].revents & POLLIN) != 0) {
      std::uint64_t count = 0;
      (void)!::read(wake_fd_, &count, sizeof count);
    }
    const bool frames = distribute();
    auto entry = entries.begin() + 2;
    for (auto client = clients_.begin(); client != clients_.end(); ++entry) {
      client = serve(*client, entry->revents) ? std::next(client) : put_out(client);
    }
    if (frames) bound_frames();
    camera_locked_ = std::ranges::any_of(clients_, &ClientLink::locks_camera);
    if ((entries[0].revents & POLLIN) != 0) accept_one();
  }
}

}  // namespace birdseye::wire
