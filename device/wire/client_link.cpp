#include "device/wire/client_link.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <utility>

namespace birdseye::wire {

namespace {

constexpr std::size_t kSliceBytes = 256U << 10U;
constexpr Duration kStuck = Duration::from_ms(10'000);
constexpr Duration kHalfAsked = Duration::from_ms(5'000);
// A client asks for the time some times a second, and for more as it begins.
constexpr Duration kPerRequest = Duration::from_ms(10);
constexpr std::int64_t kRequestsAtOnce = 200;

}  // namespace

ClientLink::ClientLink(std::unique_ptr<Link> link, std::shared_ptr<RateLimit> of_host)
    : link_(std::move(link)),
      host_(link_->host()),
      progress_(device_now()),
      requests_(kPerRequest, kRequestsAtOnce),
      of_host_(std::move(of_host)) {}

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
  const DeviceTime now = device_now();
  if (tracking_interval_.ns > 0 && now - tracking_sent_ < tracking_interval_) return false;
  tracking_sent_ = now;
  return true;
}

std::size_t ClientLink::offer(const Packet& packet) {
  if (!wants(packet)) return 0;
  if (!wants_to_write()) progress_ = device_now();
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
  std::array<std::span<const std::uint8_t>, 2> parts;
  std::size_t count = 0;
  const auto add = [&](const std::vector<std::uint8_t>& bytes, std::size_t from, std::size_t most) {
    parts[count++] = std::span(bytes).subspan(from, std::min(bytes.size() - from, most));
  };
  if (sent_ < head) add(*packet.head, sent_, kSliceBytes);
  if (packet.pixels) add(*packet.pixels, sent_ > head ? sent_ - head : 0, kSliceBytes);
  const auto put = link_->write_some(std::span(parts).first(count));
  if (!put) return false;
  if (*put == 0) return true;
  progress_ = device_now();
  if (!sending_) sending_ = waiting_.pop();
  sent_ += *put;
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
  const auto got = link_->read_some(chunk);
  if (!got) return got.error();
  if (*got == 0) return std::vector<Request>{};
  const bool fresh = !reader_.waiting();
  auto requests = reader_.push(std::span(chunk).first(*got));
  const DeviceTime now = device_now();
  if (fresh || (requests && !requests->empty())) asking_since_ = now;
  const auto count = requests ? static_cast<std::int64_t>(requests->size()) : 0;
  requests_.passed(now, count);
  if (of_host_) of_host_->passed(now, count);
  return requests;
}

bool ClientLink::stuck() const {
  const DeviceTime now = device_now();
  return (wants_to_write() && now - progress_ > kStuck) || (reader_.waiting() && now - asking_since_ > kHalfAsked);
}

}  // namespace birdseye::wire
