#include "host/guide/live_rests.hpp"

#include <utility>

#include "host/texts/texts.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kEnough = Duration::from_ms(500), kLeast = Duration::from_ms(180);
constexpr Duration kPosesPast = Duration::from_ms(45);  // the detector wants 40 ms of poses from after a frame
constexpr std::size_t kMostPending = 12, kMostKept = 8;

calibration::StillSettings still_settings() {
  calibration::StillSettings settings;
  settings.kept = Duration::from_ms(10'000);
  return settings;
}

}  // namespace

LiveRests::LiveRests(std::string bird) : bird_(std::move(bird)), still_(still_settings()) {}

void LiveRests::push(const wire::Birds& birds) {
  for (const wire::Bird& bird : birds.birds) {
    if (bird.name != bird_) continue;
    still_.push(birds.acquired, bird.tracker_from_sensor);
    newest_pose_ = birds.acquired;
    break;
  }
  while (!pending_.empty() && newest_pose_ >= pending_.front().info.acquired + kPosesPast) {
    const wire::VideoFrame frame = std::move(pending_.front());
    pending_.pop_front();
    consider(frame);
  }
}

void LiveRests::push(const wire::VideoFrame& frame) {
  newest_ = frame;
  pending_.push_back(frame);
  if (pending_.size() <= kMostPending) return;
  pending_.pop_front();
  ++left_out_;
}

void LiveRests::consider(const wire::VideoFrame& frame) {
  if (!still_.still_at(frame.info.acquired)) {
    finish_rest();
    rest_.reset();
    return;
  }
  if (!rest_) {
    rest_ = Rest();
    rest_->first = frame.info.acquired;
  }
  if (rest_->done) return;
  rest_->last = frame.info.acquired;
  keep(frame);
  if (rest_->last - rest_->first >= kEnough) finish_rest();
}

void LiveRests::keep(const wire::VideoFrame& frame) {
  Rest& rest = *rest_;
  if (rest.seen++ % rest.stride != 0) return;
  rest.frames.push_back(frame);
  if (rest.frames.size() < kMostKept) return;
  std::vector<wire::VideoFrame> every_second;
  every_second.reserve(kMostKept);
  for (std::size_t i = 0; i < rest.frames.size(); i += 2) every_second.push_back(std::move(rest.frames[i]));
  rest.frames = std::move(every_second);
  rest.stride *= 2;
}

void LiveRests::finish_rest() {
  if (!rest_ || rest_->done) return;
  rest_->done = true;
  const std::vector<wire::VideoFrame> frames = std::move(rest_->frames);
  if (rest_->last - rest_->first < kLeast) return;
  const auto pose = still_.rest_between(rest_->first, rest_->last);
  if (!pose) {
    remark_ = words("guide_few_poses");
    return;
  }
  taken_.push_back({frames[frames.size() / 2], pose->tracker_from_sensor});
}

std::optional<LiveRest> LiveRests::take() {
  if (taken_.empty()) return std::nullopt;
  LiveRest rest = std::move(taken_.front());
  taken_.pop_front();
  return rest;
}

std::string LiveRests::take_remark() {
  return std::exchange(remark_, {});
}

std::string LiveRests::left_out_words() const {
  if (left_out_ == 0) return {};
  return words("guide_left_out", left_out_, bird_);
}

}  // namespace birdseye::host
