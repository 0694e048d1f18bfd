#include "device/wire/server.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace birdseye::wire {

namespace {

constexpr std::size_t kMostFrameBytesHeld = 96U << 20U;  // fifteen frames of 1080p
constexpr std::size_t kMostClients = 16;
constexpr std::size_t kMostStrangers = 12;          // of machines that are not known, where plain is allowed
constexpr Duration kLook = Duration::from_ms(200);  // for clients that are stuck
constexpr Duration kLookAgain = Duration::from_ms(1), kAsksAgain = Duration::from_ms(10);

}  // namespace

Result<std::unique_ptr<Server>> Server::listen(const std::string& bind_address, int port, Admission admission) {
  auto listener = listen_tcp(bind_address, port, std::move(admission));
  if (!listener) return listener.error();
  return over(*std::move(listener));
}

std::unique_ptr<Server> Server::over(std::unique_ptr<Listener> listener) {
  return std::unique_ptr<Server>(new Server(std::move(listener)));
}

Server::Server(std::unique_ptr<Listener> listener) : listener_(std::move(listener)) {
  thread_ = OwnedThread([this](const std::stop_token& stop) { run(stop); });
}

Server::~Server() {
  thread_.request_stop();
  listener_->wake();
  thread_.join();
}

void Server::publish(const Packet& packet) {
  {
    const std::lock_guard lock(mutex_);
    messages_shed_ += inbox_.push(packet);
  }
  listener_->wake();
}

Server::Counters Server::take_counters() {
  Counters counters{clients_count_, messages_shed_, requests_refused_, clients_shed_, 0, 0, 0};
  counters.latency_ms_p99_tracker = latencies_.tracker.take_p99_ms();
  counters.latency_ms_p99_tracker_beside_frames = latencies_.tracker_beside_frames.take_p99_ms();
  counters.latency_ms_p99_frame = latencies_.frame.take_p99_ms();
  return counters;
}

void Server::accept_one() {
  accepts_.passed(device_now());
  auto link = listener_->accept();
  if (!link) return;
  if (!make_room(*link)) {
    ++clients_shed_;  // before the client can know
    return;
  }
  auto limit = requests_.of(link->host(), device_now());
  clients_.emplace_back(std::move(link), std::move(limit));
  if (last_status_) offer(clients_.back(), *last_status_);
  if (last_calibration_) offer(clients_.back(), *last_calibration_);
  if (last_volume_) offer(clients_.back(), *last_volume_);
  ++clients_count_;
}

bool Server::make_room(const Link& link) {
  const auto strangers = static_cast<std::size_t>(std::ranges::count(clients_, false, &ClientLink::is_known));
  const bool known = link.is_known();
  if (clients_.size() < kMostClients && (known || strangers < kMostStrangers)) return true;
  if (!known && strangers == 0) return false;
  std::map<std::string, std::size_t> held;
  for (const ClientLink& client : clients_) {
    if (strangers == 0 || !client.is_known()) ++held[client.host()];
  }
  const auto most = std::ranges::max_element(held, {}, [](const auto& of_host) { return of_host.second; });
  const bool before_strangers = known && strangers > 0;
  if (!before_strangers && most->second < held[link.host()] + 2) return false;
  // The newest: those before it were there first.
  const auto newest = std::ranges::find(clients_.rbegin(), clients_.rend(), most->first, &ClientLink::host);
  put_out(std::prev(newest.base()));
  ++clients_shed_;
  return true;
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

void Server::note_fills() {
  QueueFill frames{.queue = "frames for the clients",
                   .most_values = PacketQueue::kMostFrames * clients_.size(),
                   .bytes = frame_bytes_held(),
                   .most_bytes = kMostFrameBytesHeld};
  QueueFill small{.queue = "messages for the clients", .most_values = PacketQueue::kMostSmall * clients_.size()};
  for (const ClientLink& client : clients_) {
    frames.values += client.frames_waiting();
    small.values += client.small_waiting();
  }
  const std::lock_guard lock(mutex_);
  frames_fill_ = std::move(frames);
  small_fill_ = std::move(small);
}

std::vector<QueueFill> Server::fills() {
  const std::lock_guard lock(mutex_);
  return {frames_fill_, small_fill_};
}

void Server::answer(ClientLink& client, const Request& request) {
  if (const auto* ping = std::get_if<ClockPing>(&request)) {
    const DeviceTime now = device_now();
    offer(client, pack(ClockPong{ping->host_sent_ns, now, now}));
  } else if (const auto* subscription = std::get_if<Subscription>(&request)) {
    client.take(*subscription);
  } else if (const auto* lock = std::get_if<CameraLock>(&request)) {
    take_lock(client, *lock);
  } else if (const auto* tracking = std::get_if<TrackingRequest>(&request)) {
    client.take(*tracking);
    offer(client, pack_tracking_reply(true));
  } else if (std::holds_alternative<StatusRequest>(request)) {
    if (last_status_) offer(client, *last_status_);
  } else if (std::holds_alternative<DamagedRequest>(request)) {
    ++requests_refused_;
  }
}

void Server::take_lock(ClientLink& client, const CameraLock& lock) {
  if (client.is_known()) return client.take(lock);
  const std::string why = "only this machine and paired ones may hold the camera's controls: birdseye pair";
  offer(client, pack(CameraControls{camera_locked_, {}, {why}}, device_now()));
}

bool Server::serve(ClientLink& client, const LinkWatch& told) {
  if (told.broken) return false;
  if (told.readable) {
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
  std::vector<LinkWatch> watches;
  while (!stop.stop_requested()) {
    watches.clear();
    bool all_may_ask = true;
    for (const ClientLink& client : clients_) {
      const bool may_ask = client.may_ask();
      all_may_ask = all_may_ask && may_ask;
      watches.push_back({.link = &client.link(), .to_read = may_ask, .to_write = client.wants_to_write()});
    }
    const DeviceTime now = device_now();
    const bool accepts = now >= accepts_.free_at();
    const Duration look = accepts ? (all_may_ask ? kLook : kAsksAgain) : kLookAgain;
    const bool somebody = listener_->wait(watches, accepts, Deadline::after(look));
    const bool frames = distribute();
    auto watch = watches.begin();
    for (auto client = clients_.begin(); client != clients_.end(); ++watch) {
      client = serve(*client, *watch) ? std::next(client) : put_out(client);
    }
    if (frames) {
      bound_frames();
      note_fills();
    }
    camera_locked_ = std::ranges::any_of(clients_, &ClientLink::locks_camera);
    if (somebody) accept_one();
  }
}

}  // namespace birdseye::wire
