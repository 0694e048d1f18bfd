#include "host/link/event_stream.hpp"

#include <algorithm>

#include "device/wire/clock_discipline.hpp"

namespace birdseye::host {

EventStream::EventStream(std::unique_ptr<wire::Client> client, std::size_t most_frames)
    : client_(std::move(client)), most_frames_(most_frames) {
  thread_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
}

void EventStream::read(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    auto event = client_->next(wire::Client::Clock::now() + std::chrono::milliseconds(100));
    const bool ended = !event;
    if (!ended && *event && std::holds_alternative<wire::Health>(**event)) {
      if (const auto clock = wire::read_clock_discipline())
        client_->use_discipline(*clock, wire::wall_minus_monotonic());
    }
    const std::optional<ClockGap> gap = ended || !*event ? std::nullopt : gap_at(**event);
    std::string words = client_->peer_words();
    {
      const std::lock_guard lock(mutex_);
      if (gap) gap_ = gap;
      peer_words_ = std::move(words);
      if (ended) {
        ended_ = event.error();
      } else if (*event) {
        keep(**std::move(event));
      }
    }
    changed_.notify_one();
    if (ended) return;
  }
}

std::optional<ClockGap> EventStream::gap_at(const wire::Event& event) const {
  const auto* frame = std::get_if<wire::VideoFrame>(&event);
  if (frame == nullptr) return std::nullopt;
  const auto related = client_->host_from_device(frame->info.acquired);
  if (!related) return std::nullopt;
  return ClockGap{Duration{related->time.ns - frame->info.acquired.ns}, related->sigma};
}

std::optional<ClockGap> EventStream::host_from_device() const {
  const std::lock_guard lock(mutex_);
  return gap_;
}

std::string EventStream::peer_words() const {
  const std::lock_guard lock(mutex_);
  return peer_words_;
}

void EventStream::keep(wire::Event event) {
  const auto is_frame = [](const wire::Event& e) { return std::holds_alternative<wire::VideoFrame>(e); };
  if (is_frame(event)) {
    if (frames_ == most_frames_) {
      events_.erase(std::find_if(events_.begin(), events_.end(), is_frame));
      --frames_;
    }
    ++frames_;
  } else if (events_.size() - frames_ >= kMostOthers) {
    return;
  }
  events_.push_back(std::move(event));
}

Result<std::optional<wire::Event>> EventStream::next(wire::Client::Clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, deadline, [this] { return !events_.empty() || ended_.has_value(); });
  if (events_.empty()) {
    if (ended_) return *ended_;
    return std::optional<wire::Event>();
  }
  std::optional<wire::Event> event = std::move(events_.front());
  events_.pop_front();
  if (std::holds_alternative<wire::VideoFrame>(*event)) --frames_;
  return event;
}
}  // namespace birdseye::host
