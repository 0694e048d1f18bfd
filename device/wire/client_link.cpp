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

constexpr std::size_t kMostQueuedBytes = 32U << 20U;  // about a second of PAL video, or five frames of 1080p
constexpr std::size_t kMostSmall = 4096;              // packets
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

bool ClientLink::offer(const Packet& packet) {
  if (!wants(packet)) return true;
  const bool idle = !wants_to_write();
  const bool frame = packet.kind == Packet::Kind::frame;
  const bool full = frame ? queued_bytes_ + packet.size() > kMostQueuedBytes : small_.size() >= kMostSmall;
  if (full && !idle) return false;
  if (idle) progress_ = monotonic_now();
  if (frame) queued_bytes_ += packet.size();
  (frame ? frames_ : small_).push_back(packet);
  return true;
}

bool ClientLink::send_some(Latencies& latencies) {
  if (!sending_) {
    std::deque<Packet>& from = small_.empty() ? frames_ : small_;
    if (from.empty()) return true;
    sending_ = std::move(from.front());
    from.pop_front();
    sent_ = 0;
  }
  const std::size_t head = sending_->head->size();
  std::array<iovec, 2> parts{};
  std::size_t count = 0;
  const auto add = [&](const std::vector<std::uint8_t>& bytes, std::size_t from, std::size_t most) {
    // writev takes what it sends as something it might change.
    parts[count++] = {const_cast<std::uint8_t*>(bytes.data()) + from, std::min(bytes.size() - from, most)};
  };
  if (sent_ < head) add(*sending_->head, sent_, kSliceBytes);
  if (sending_->pixels) add(*sending_->pixels, sent_ > head ? sent_ - head : 0, kSliceBytes);
  msghdr message{};
  message.msg_iov = parts.data();
  message.msg_iovlen = count;
  const ssize_t put = ::sendmsg(fd_, &message, MSG_NOSIGNAL);
  if (put < 0) return errno == EAGAIN || errno == EINTR;
  progress_ = monotonic_now();
  sent_ += static_cast<std::size_t>(put);
  if (sent_ < sending_->size()) return true;
  const bool frame = sending_->kind == Packet::Kind::frame;
  if (frame) queued_bytes_ -= sending_->size();
  LatencyLog& tracker = subscription_.frames ? latencies.tracker_beside_frames : latencies.tracker;
  if (sending_->arrived.ns != 0) (frame ? latencies.frame : tracker).add(progress_ - sending_->arrived);
  sending_.reset();
  return true;
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
