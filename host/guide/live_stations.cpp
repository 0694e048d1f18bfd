#include "host/guide/live_stations.hpp"

#include <fmt/format.h>

#include "calibration/detect/detect.hpp"
#include "host/files/picture.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kEnough = Duration::from_ms(500), kLeast = Duration::from_ms(180);
constexpr Duration kPosesPast = Duration::from_ms(45);  // the detector wants 40 ms of poses from after a frame
constexpr std::size_t kMostPending = 12, kMostKept = 8;

calibration::Detection find(const calibration::Pattern& pattern, const wire::VideoFrame& frame,
                            const std::string& name) {
  const std::vector<std::uint8_t> grey = grey_of({*frame.rgb, frame.width_px, frame.height_px});
  return calibration::detect(pattern, {grey, frame.width_px, frame.height_px}, name, calibration::Search::quick);
}

}  // namespace

void LiveStations::push(const wire::Birds& birds) {
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

void LiveStations::push(const wire::VideoFrame& frame) {
  newest_ = frame;
  pending_.push_back(frame);
  if (pending_.size() <= kMostPending) return;
  pending_.pop_front();
  ++left_out_;
}

void LiveStations::consider(const wire::VideoFrame& frame) {
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

void LiveStations::keep(const wire::VideoFrame& frame) {
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

void LiveStations::finish_rest() {
  if (!rest_ || rest_->done) return;
  rest_->done = true;
  const std::vector<wire::VideoFrame> frames = std::move(rest_->frames);
  if (rest_->last - rest_->first < kLeast) return;
  const auto pose = still_.rest_between(rest_->first, rest_->last);
  if (!pose) {
    remark_ = "not taken: the tracker gave too few poses while the scope was still";
    return;
  }
  const wire::VideoFrame& middle = frames[frames.size() / 2];
  calibration::Detection found = find(pattern_, middle, fmt::format("station {}", taken_ + 1));
  if (!found.view) {
    remark_ = "not taken: " + found.rejected + "; all of the pattern has to be in the picture, sharp and evenly lit";
    return;
  }
  ++taken_;
  stations_.push_back({*std::move(found.view), pose->tracker_from_sensor, middle});
}

std::optional<LiveStation> LiveStations::take_station() {
  if (stations_.empty()) return std::nullopt;
  LiveStation station = std::move(stations_.front());
  stations_.pop_front();
  return station;
}

std::string LiveStations::take_remark() {
  return std::exchange(remark_, {});
}

std::string LiveStations::left_out_words() const {
  if (left_out_ == 0) return {};
  return fmt::format("{} frames were left out: no poses of \"{}\" came for them in time", left_out_, bird_);
}

std::optional<calibration::PatternView> LiveStations::look() const {
  if (!newest_) return std::nullopt;
  return find(pattern_, *newest_, "now").view;
}

}  // namespace birdseye::host
