#include "host/guide/guide_worker.hpp"

#include <deque>
#include <mutex>
#include <utility>

#include "drivers/system/blocking_queue.hpp"
#include "host/link/drops.hpp"
#include "host/link/event_bytes.hpp"
#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr std::size_t kMostLines = 40, kMostFrames = 50, kMostPoses = 2000;
constexpr std::size_t kMostFrameBytes = 320U << 20U, kMostPoseBytes = 16U << 20U;  // of 1080p, fifty frames

}  // namespace

class GuideWorker::Session {
 public:
  void push(const wire::Event& event) {
    if (std::holds_alternative<wire::VideoFrame>(event)) events_.push(kFrames, event, bytes_of(event));
    if (std::holds_alternative<wire::Birds>(event)) events_.push(kPoses, event, bytes_of(event));
  }
  void end(const std::string& why) {
    {
      const std::lock_guard lock(mutex_);
      if (end_.empty()) end_ = why;
    }
    events_.close();
  }
  [[nodiscard]] GuideState state() const {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  [[nodiscard]] std::vector<std::string> lines() const {
    const std::lock_guard lock(mutex_);
    return {lines_.begin(), lines_.end()};
  }

  /// The thread's part.
  Result<GuidedCalibration> guide(const std::stop_token& stop, const GuidePlan& plan) {
    const Error cancelled{Errc::disconnected, "cancelled"};
    HandEyeGuide guide(plan, {[](const std::string&) {}, [this](const std::string& line) { tell(line); }});
    while (!guide.ended()) {
      const auto event = next(stop);
      if (stop.stop_requested()) return cancelled;
      if (event) {
        if (auto taken = guide.take(*event); !taken) return taken.error();
      } else {
        const std::lock_guard lock(mutex_);
        guide.end(end_);
      }
      const std::lock_guard lock(mutex_);
      state_ = guide.state();
    }
    const Drops drops{events_.dropped(kFrames), events_.dropped(kPoses)};
    if (const std::string words = drops.words(); !words.empty()) tell(words);
    {
      const std::lock_guard lock(mutex_);
      state_.collecting = false;
      state_.next = words("guide_enough");
    }
    GuidedStations stations = guide.finish();
    if (stop.stop_requested()) return cancelled;
    return calibrate_guided(std::move(stations));
  }

 private:
  enum Lane : std::size_t { kFrames, kPoses, kLanes };

  std::optional<wire::Event> next(const std::stop_token& stop) {
    auto event = events_.pop(stop);
    const std::lock_guard lock(mutex_);
    return end_.empty() ? std::move(event) : std::nullopt;
  }
  void tell(const std::string& line) {
    const std::lock_guard lock(mutex_);
    lines_.push_back(line);
    if (lines_.size() > kMostLines) lines_.pop_front();
  }

  BlockingQueue<wire::Event, kLanes> events_{
      {{{kMostFrames, WhenFull::drop_oldest, kMostFrameBytes}, {kMostPoses, WhenFull::refuse, kMostPoseBytes}}}};
  mutable std::mutex mutex_;  // of what follows
  std::string end_;
  GuideState state_;
  std::deque<std::string> lines_;
};

void GuideWorker::start(GuidePlan plan) {
  session_ = std::make_shared<Session>();
  work_.start([session = session_, plan = std::move(plan)](const std::stop_token& stop, const auto& /*say*/) {
    return session->guide(stop, plan);
  });
}

void GuideWorker::give_up() {
  work_.cancel();
  session_.reset();
}

void GuideWorker::push(const wire::Event& event) {
  if (session_) session_->push(event);
}

void GuideWorker::end(const std::string& why) {
  if (session_) session_->end(why);
}

std::optional<GuideState> GuideWorker::state() const {
  if (!session_) return std::nullopt;
  return session_->state();
}

std::vector<std::string> GuideWorker::lines() const {
  return session_ ? session_->lines() : std::vector<std::string>();
}

std::optional<Result<GuidedCalibration>> GuideWorker::take() {
  auto found = work_.take();
  if (!found || !session_) return std::nullopt;  // what was given up is not told
  session_.reset();
  return found;
}

}  // namespace birdseye::host
