#include "device/wire/client_link.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/uio.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>

namespace birdseye::wire {

namespace {

constexpr std::size_t kSliceBytes = 256U << 10U;
constexpr Duration kStuck = Duration::from_ms(10'000);
constexpr Duration kHalfAsked = Duration::from_ms(5'000);

}  // namespace

DeviceTime monotonic_now() {
  // CLOCK_MONOTONIC, by the C++ library of every Linux.
  return {std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
              .count()};
}

ClientLink::ClientLink(int fd) : fd_(fd), progress_(monotonic_now()) {}

ClientLink::~ClientLink() {
  ::close(fd_);
}

void ClientLink::take(const Subscription& subscription) {
  subscription_ = subscription;
  if (!subscription_.frames) waiting_.forget_frames();
}

void ClientLink::take(const TrackingRequest& request) {
  subscription_.tracking = request.start;
  tracking_interval_ = request.interval;
}

bool ClientLink::wants(const Packet& packet) {
  if (packet.kind == Packet::Kind::frame) return subscription_.frames;
  if (packet.kind != Packet::Kind::tracking) return true;
  if (!subscription_.tracking) return false;
  const DeviceTime now = monotonic_now();
  if (tracking_interval_.ns > 0 && now - tracking_sent_ < tracking_interval_) return false;
  tracking_sent_ = now;
  return true;
}

std::size_t ClientLink::offer(const Packet& packet) {
  if (!wants(packet)) return 0;
  if (!wants_to_write()) progress_ = monotonic_now();
  return waiting_.push(packet);
}

void ClientLink::add_pixels_to(std::vector<const std::vector<std::uint8_t>*>& pixels) const {
  if (sends_frame()) pixels.push_back(sending_->pixels.get());
  for (const Packet& packet : waiting_.frames()) pixels.push_back(packet.pixels.get());
}

bool ClientLink::send_some(Latencies& latencies) {
  if (!wants_to_write()) return true;
  const Packet& packet = sending_ ? *sending_ : waiting_.front();
  const std::size_t head = packet.head->size();
  std::array<iovec, 2> parts{};
  std::size_t count = 0;
  const auto add = [&](const std::vector<std::uint8_t>& bytes, std::size_t from, std::size_t most) {
    // writev takes what it sends as something it might change.
    parts[count++] = {const_cast<std::uint8_t*>(bytes.data()) + from, std::min(bytes.size() - from, most)};
  };
  if (sent_ < head) add(*packet.head, sent_, kSliceBytes);
  if (packet.pixels) add(*packet.pixels, sent_ > head ? sent_ - head : 0, kSliceBytes);
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = count;
  const ssize_t put = ::sendmsg(fd_, &message, MSG_NOSIGNAL);
  if (put < 0) return errno == EAGAIN || errno == EINTR;
  progress_ = monotonic_now();
  if (!sending_) sending_ = waiting_.pop();
  sent_ += static_cast<std::size_t>(put);
  if (sent_ == sending_->size()) finish(latencies);
  return true;
}

void ClientLink::finish(Latencies& latencies) {
  LatencyLog& tracker = subscription_.frames ? latencies.tracker_beside_frames : latencies.tracker;
  if (sending_->arrived.ns != 0) (sends_frame() ? latencies.frame : tracker).add(progress_ - sending_->arrived);
  sending_.reset();
  sent_ = 0;
}

Result<std::vector<Request>> ClientLink::receive() {
  std::array<std::uint8_t, 4096> chunk;
  const ssize_t got = ::recv(fd_, chunk.data(), chunk.size(), MSG_DONTWAIT);
  if (got < 0 && (errno == EAGAIN || errno == EINTR)) return std::vector<Request>{};
  if (got <= 0) return Error{Errc::disconnected, "the client has gone"};
  const bool fresh = !reader_.waiting();
  auto requests = reader_.push(std::span(chunk).first(static_cast<std::size_t>(got)));
  if (fresh || (requests && !requests->empty())) asking_since_ = monotonic_now();
  return requests;
}

bool ClientLink::stuck() const {
  const DeviceTime now = monotonic_now();
  return (wants_to_write() && now - progress_ > kStuck) || (reader_.waiting() && now - asking_since_ > kHalfAsked);
}

}  // namespace birdseye::wire
