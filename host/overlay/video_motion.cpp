#include "host/overlay/video_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "host/overlay/followed_places.hpp"

namespace birdseye::host {

namespace {

using Relative = Transform<Camera, Camera>;

constexpr Duration kEvery = Duration::from_ms(100), kLongest = Duration::from_ms(3000);
constexpr Duration kAverage = Duration::from_ms(40);  // half the width of what a pose is averaged over
constexpr std::size_t kFewest = 15;
constexpr double kTurned_rad = 15 * M_PI / 180;
constexpr double kNotModelled = 0.15;  // of what a hand-eye turned by kTurned_rad would do
constexpr double kPlainly = 3;         // so many times as far off would be plain
constexpr int kOddInRow = 4, kMostWanted = 32;

PoseHistory averaged_poses() {
  PoseHistory::Settings settings;
  settings.capacity = 512;
  settings.smoothing = kAverage;
  return PoseHistory(settings);
}

}  // namespace

struct VideoMotion::Waiting {
  DeviceTime at;
  double times_apart_s = 0;  ///< of the frame and the poses
  PictureToFollow picture;
};

struct VideoMotion::Key {
  DeviceTime at;
  SeenFrom from;
  std::vector<cv::Point2f> places;  ///< in the key's picture
  PictureToFollow newest;           ///< the last picture that they were followed to
  std::vector<cv::Point2f> now;     ///< and where they are in it
  std::array<bool, 3> told{};       ///< by pictures since, about each axis
};

VideoMotion::VideoMotion() : poses_(averaged_poses()) {}

VideoMotion::~VideoMotion() = default;

/// What has agreed before tells nothing of what comes.
void VideoMotion::forget_agreement() {
  told_ = {};
  state_ = VideoAgreement::untold;
}

bool VideoMotion::doubt(DeviceTime since) {
  doubted_since_ = since;
  if (state_ != VideoAgreement::agrees) return false;
  state_ = VideoAgreement::in_doubt;
  return true;
}

void VideoMotion::reset() {
  doubted_since_.reset();
  waiting_.reset();
  key_.reset();
  looked_at_.reset();
  told_ = {};
  wanted_ = 1;
  odd_ = 0;
  state_ = VideoAgreement::untold;
  off_px_.reset();
}

void VideoMotion::take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  // Of another clock than those before: they are of no use any more.
  if (const auto newest = poses_.newest(); newest && acquired < *newest) {
    reset();
    poses_ = averaged_poses();
  }
  poses_.push(acquired, Duration{0}, tracker_from_sensor);
}

bool VideoMotion::take(const wire::VideoFrame& frame, const ScopeSetup& scope) {
  bool changed = false;
  if (of_ && !of_->sees_as(scope)) {
    changed = state_ != VideoAgreement::untold;
    reset();
  }
  of_ = scope;
  const DeviceTime at = frame.info.acquired;
  if (waiting_) {
    const auto newest = poses_.newest();
    if (newest && *newest >= waiting_->at + kAverage + kAverage) {
      changed = look(*waiting_, scope);
      waiting_.reset();
    } else if (at - waiting_->at > kEvery || at < waiting_->at) {
      waiting_.reset();  // no poses come
    }
  }
  const CameraModel& camera = scope.camera();
  const bool due = !looked_at_ || at - *looked_at_ >= kEvery || at < *looked_at_;
  if (waiting_ || !due || frame.width_px != camera.width_px || frame.height_px != camera.height_px) return changed;
  looked_at_ = at;
  auto next = std::make_unique<Waiting>();
  next->at = at;
  next->times_apart_s = times_apart_s(
      Duration::from_seconds(std::hypot(frame.info.acquired_sigma.seconds(), frame.info.pose.time_sigma.seconds())),
      frame.info.latency.has_value());
  next->picture = picture_to_follow(frame);
  waiting_ = std::move(next);
  return changed;
}

std::optional<VideoMotion::SeenFrom> VideoMotion::seen_from(const Waiting& waiting, const ScopeSetup& scope) const {
  std::array<std::optional<Transform<Camera, Tracker>>, 3> at;  // before, at and after the picture
  for (std::size_t i = 0; i < at.size(); ++i) {
    const PoseAnswer pose = poses_.at(waiting.at + Duration{(static_cast<std::int64_t>(i) - 1) * kAverage.ns});
    if (!pose.tracker_from_sensor || pose.kind == PoseKind::predicted) return std::nullopt;
    at[i] = scope.camera_from_sensor() * pose.tracker_from_sensor->inverse();
  }
  SeenFrom out{*at[1]};
  // Where the camera speeds up the average of its poses is off, and where it is fast so is what it sees of another
  // time.
  const Transform<Tracker, Camera> back = at[1]->inverse();
  for (const Eigen::Vector3d& place_mm : {Eigen::Vector3d(0, 0, 100), Eigen::Vector3d(40, 0, 100)}) {
    const Eigen::Vector3d before = *at[0] * (back * place_mm), after = *at[2] * (back * place_mm);
    if (!(before.z() > kNearestSeen_mm && after.z() > kNearestSeen_mm)) return std::nullopt;
    const Eigen::Vector2d from = before.hnormalized(), to = after.hnormalized(), middle = place_mm.hnormalized();
    const double bend = ((from + to) / 2 - middle).norm();
    const double rate_s = (to - from).norm() / (2 * kAverage.seconds());
    out.unsure_px =
        std::max(out.unsure_px, scope.camera().fx_px * std::hypot(bend, 2 * rate_s * waiting.times_apart_s));
  }
  return out;
}

/// True: state() is another now.
bool VideoMotion::look(const Waiting& waiting, const ScopeSetup& scope) {
  const auto from = seen_from(waiting, scope);
  if (!from) {
    key_.reset();
    return false;
  }
  const VideoAgreement before = state_;
  if (key_) follow(waiting);
  const bool told = key_ && key_->places.size() >= kFewest && judge(waiting.at, *from, scope);
  if (key_ && key_->places.size() >= kFewest && waiting.at - key_->at < kLongest && !(told && odd_ >= kOddInRow))
    return state_ != before;
  key_ = std::make_unique<Key>();
  key_->at = waiting.at;
  key_->from = *from;
  key_->places = places_to_follow(waiting.picture.grey);
  key_->now = key_->places;
  key_->newest = waiting.picture;
  return state_ != before;
}

/// To the next picture; what is not found there, or leads back to another place, is let go.
void VideoMotion::follow(const Waiting& waiting) {
  if (key_->places.empty() || key_->newest.grey.size() != waiting.picture.grey.size()) return key_.reset();
  const auto there = follow_places(key_->newest, waiting.picture, key_->now);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < there.size(); ++i) {
    if (!there[i]) continue;
    key_->places[kept] = key_->places[i];
    key_->now[kept++] = *there[i];
  }
  // Where most are lost at once the picture is another, and what is left is chance.
  if (2 * kept < there.size()) {
    if (state_ == VideoAgreement::agrees || state_ == VideoAgreement::in_doubt) forget_agreement();
    return key_.reset();
  }
  key_->places.resize(kept);
  key_->now.resize(kept);
  key_->newest = waiting.picture;
}

/// True: the picture does not agree.
bool VideoMotion::judge(DeviceTime at, const SeenFrom& now, const ScopeSetup& scope) {
  const auto& held_out_px = scope.figures().held_out_px;
  if (!held_out_px) return false;  // nothing says how far off a picture may be
  const CameraModel& camera = scope.camera();
  const int columns = key_->newest.grey.cols;
  std::vector<FollowedPlace> places;
  places.reserve(key_->places.size());
  for (std::size_t i = 0; i < key_->places.size(); ++i) {
    const auto then = ray_of(camera, columns, key_->places[i]), later = ray_of(camera, columns, key_->now[i]);
    if (then && later) places.push_back({*then, *later});
  }
  if (places.size() < kFewest) return false;
  const Relative motion = now.camera_from_tracker * key_->from.camera_from_tracker.inverse();
  const auto off = median_off_line(places, motion);
  if (!off) return false;
  off_px_ = *off * camera.fx_px;
  std::array<double, 3> otherwise_px{};  // by axis, how far off they would be with a hand-eye that is turned about it
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto off_if_turned = median_off_if_turned(places, motion, axis, kTurned_rad);
    otherwise_px[static_cast<std::size_t>(axis)] = off_if_turned.value_or(0) * camera.fx_px;
  }
  const double scale = static_cast<double>(camera.width_px) / columns;
  // The errors of hand-eye and of two poses, of two axes, with a probability of 99.9 %, for many pictures are asked;
  // how well a place is found; how sure the two poses are; and what of the motion itself is not as it is modelled.
  const double still_px =
      std::hypot(std::hypot(std::sqrt(13.8) * *held_out_px, kFollowedPx * scale), now.unsure_px + key_->from.unsure_px);
  const double allowed_px = std::hypot(still_px, kNotModelled * *std::ranges::max_element(otherwise_px));
  if (*off_px_ > allowed_px) {
    odd_ += *off_px_ > kPlainly * allowed_px ? kOddInRow : 1;
    if (odd_ < kOddInRow) {
      // The next pictures tell. Until then nothing says that this one is right.
      if (state_ == VideoAgreement::agrees) state_ = VideoAgreement::in_doubt;
      return true;
    }
    if (state_ != VideoAgreement::differs) wanted_ = std::min(2 * wanted_, kMostWanted);
    state_ = VideoAgreement::differs;
    told_ = {};
    return true;
  }
  odd_ = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(otherwise_px[axis] > std::max(still_px, kPlainly * *off_px_))) continue;
    if (!std::exchange(key_->told[axis], true)) ++told_[axis];
  }
  if (doubted_since_ && at < *doubted_since_) return false;
  if (std::ranges::all_of(told_, [this](int times) { return times >= wanted_; })) state_ = VideoAgreement::agrees;
  return false;
}

}  // namespace birdseye::host
