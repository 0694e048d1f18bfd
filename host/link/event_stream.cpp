#include "host/link/event_stream.hpp"

#include <utility>

#include "device/wire/clock_discipline.hpp"
#include "host/link/event_bytes.hpp"

namespace birdseye::host {

namespace {
constexpr Duration kLook = Duration::from_ms(100);  // how soon a stop is seen
}  // namespace

std::optional<DeviceTime> acquired_of(const wire::Event& event) {
  if (const auto* frame = std::get_if<wire::VideoFrame>(&event)) return frame->info.acquired;
  if (const auto* birds = std::get_if<wire::Birds>(&event)) return birds->acquired;
  return std::nullopt;
}

EventStream::EventStream(std::unique_ptr<wire::Client> client, std::size_t most_frames)
    : client_(std::move(client)),
      plain_(client_->is_plain()),
      machine_(client_->machine()),
      events_({{{most_frames, WhenFull::drop_oldest, kMostFrameBytes},
                {kMostOthers, WhenFull::refuse, kMostOtherBytes},
                {kMostOthers, WhenFull::refuse, kMostOtherBytes}}}) {
  thread_ = OwnedThread([this](const std::stop_token& stop) { read(stop); });
}

void EventStream::read(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    auto event = client_->next(Deadline::after(kLook));
    const bool ended = !event;
    if (!ended && *event && std::holds_alternative<wire::Health>(**event)) {
      if (const auto clock = wire::read_clock_discipline()) client_->use_discipline(*clock, wall_minus_monotonic());
    }
    const std::optional<ClockGap> gap = ended || !*event ? std::nullopt : gap_at(**event);
    std::string words = client_->peer_words();
    {
      const std::lock_guard lock(mutex_);
      if (gap) gap_ = gap;
      peer_words_ = std::move(words);
      if (ended) ended_ = event.error();
    }
    if (ended) {
      events_.close();
      return;
    }
    if (*event) {
      const Lane lane = lane_of(**event);
      const std::size_t bytes = bytes_of(**event);
      events_.push(lane, **std::move(event), bytes);
    }
  }
}

std::optional<ClockGap> EventStream::gap_at(const wire::Event& event) const {
  const auto acquired = acquired_of(event);
  const auto related = acquired ? client_->host_from_device(*acquired) : std::nullopt;
  if (!related) return std::nullopt;
  return ClockGap{*acquired, *related};
}

std::optional<ClockGap> EventStream::host_from_device() const {
  const std::lock_guard lock(mutex_);
  return gap_;
}

std::string EventStream::peer_words() const {
  const std::lock_guard lock(mutex_);
  return peer_words_;
}

std::vector<QueueFill> EventStream::fills() const {
  return {events_.fill(kFrames, "frames for the window"), events_.fill(kPoses, "poses for the window"),
          events_.fill(kOthers, "messages for the window")};
}

EventStream::Lane EventStream::lane_of(const wire::Event& event) {
  if (std::holds_alternative<wire::VideoFrame>(event)) return kFrames;
  return std::holds_alternative<wire::Birds>(event) ? kPoses : kOthers;
}

Result<std::optional<wire::Event>> EventStream::next(Deadline deadline) {
  auto event = events_.pop(deadline);
  if (event || !events_.finished()) return event;
  const std::lock_guard lock(mutex_);
  return *ended_;
}

}  // namespace birdseye::host
