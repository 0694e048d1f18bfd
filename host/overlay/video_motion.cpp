#include "host/overlay/video_motion.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "host/overlay/followed_places.hpp"

namespace birdseye::host {

namespace {

using Relative = Transform<Camera, Camera>;

constexpr Duration kEvery = Duration::from_ms(100), kLongest = Duration::from_ms(3000);
constexpr Duration kOnTheWayFor = Duration::from_ms(1000);
constexpr Duration kUnjudged = Duration::from_ms(250);  // without a judged picture: what has moved is not known
constexpr Duration kAverage = Duration::from_ms(40);    // half the width of what a pose is averaged over
constexpr std::size_t kFewest = 15;
constexpr double kTurned_rad = 15 * kRadPerDeg;
constexpr double kAhead_mm = 100;      // from the camera to what is told of noise
constexpr double kNotModelled = 0.15;  // of what a hand-eye turned by kTurned_rad would do
constexpr double kPlainly = 3;         // so many times as far off would be plain
constexpr double kNearlyOff = 0.75;    // of what is allowed: places farther off neither agree nor differ
constexpr double kOnTheWay = 0.5;      // a key that began here would hide half of what is wrong
constexpr double kHastePx = 5;         // of the small picture: a key whose poses leave so much open hides what is wrong
constexpr double kFarthestStepPx = 20;  // of the small picture: what moves farther in one frame is not followed safely
constexpr double kOfHaste = 0.4;        // of the poses' haste, places move so much at least; where poses leap, less
constexpr int kOddInRow = 4, kMostWanted = 32;

/// By which it is told how fast what is seen moves.
std::array<Eigen::Vector3d, 3> places_ahead_mm() {
  return {Eigen::Vector3d(0, 0, 100), Eigen::Vector3d(40, 0, 100), Eigen::Vector3d(0, 40, 100)};
}

PoseHistory averaged_poses() {
  PoseHistory::Settings settings;
  settings.capacity = 512;
  settings.smoothing = kAverage;
  return PoseHistory(settings);
}

/// Of places that are followed wrongly one in five and more lie by chance where the poses say.
bool few_agree(const std::vector<FollowedPlace>& places, const Relative& motion, double allowed, double farthest_mm) {
  const auto off = off_line(places, motion, farthest_mm);
  return 5 * std::ranges::count_if(off, [allowed](double one) { return one <= allowed; }) < std::ssize(places);
}

}  // namespace

struct VideoMotion::Waiting {
  DeviceTime at;
  double farthest_mm = kFarthestSeen_mm;
  double times_apart_s = 0;         ///< of the frame and the poses
  std::vector<cv::Point2f> then{};  ///< the key's places; empty: this is the key's picture
  std::vector<cv::Point2f> now{};   ///< where they are in this one
  double farthest_step_px = 0;      ///< of half of them, from a frame to the next, since the picture before that waited
  Duration longest_step{0};         ///< between two such frames
};

struct VideoMotion::Key {
  DeviceTime at;
  double farthest_mm = kFarthestSeen_mm;  ///< half of the places lie no farther
  std::optional<SeenFrom> from;           ///< empty: the poses after it have not come yet
  std::vector<cv::Point2f> places;        ///< in the key's picture
  PictureToFollow looked_at;              ///< the last picture that was looked at
  std::optional<SeenFrom> looked_from;    ///< the last picture that was judged, or the key's
  std::vector<cv::Point2f> looked;        ///< where they were in the last picture that was looked at
  std::size_t kept = 0;                   ///< so many
  DeviceTime judged_at;                   ///< the last picture that was judged, or the key's
  double off = 0;                         ///< in the last picture that was judged, of what is allowed
  std::size_t agreed = 0;                 ///< so many were left when they last agreed, and the scope was calm
  std::size_t left = 0;                   ///< and so many in the first picture after since that did not agree
  PictureToFollow newest;                 ///< the last frame in which most of them were found
  std::vector<cv::Point2f> now;           ///< and about where they are in it
  DeviceTime newest_at;
  double farthest_step_px = 0;  ///< since a picture last waited, as it has it
  Duration longest_step{0};
  std::array<bool, 3> told{};  ///< by pictures since, about each axis
};

VideoMotion::VideoMotion() : poses_(averaged_poses()) {}

VideoMotion::~VideoMotion() = default;
VideoMotion::VideoMotion(VideoMotion&&) noexcept = default;
VideoMotion& VideoMotion::operator=(VideoMotion&&) noexcept = default;

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
  odd_ = 0;
  state_ = VideoAgreement::untold;
  off_px_.reset();
  watched_mm_.reset();
}

void VideoMotion::take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  // Of another clock than those before: they are of no use any more.
  if (const auto newest = poses_.newest(); newest && acquired < *newest) {
    reset();
    poses_ = averaged_poses();
  }
  // What has moved meanwhile the next picture tells.
  if (const auto newest = poses_.newest(); newest && acquired - *newest > kUnjudged) doubt(acquired);
  note_noise(acquired, tracker_from_sensor);
  poses_.push(acquired, Duration{0}, tracker_from_sensor);
}

/// Of a single pose, at a place ahead of the camera; another one once the camera has turned from it.
void VideoMotion::note_noise(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  constexpr double kFarthest_mm = 200, kOfNewest = 0.1;
  constexpr Duration kGap = Duration::from_ms(130);  // no longer than that tells how often poses come
  if (const auto newest = poses_.newest(); newest && acquired - *newest <= kGap)
    between_poses_s_ += (between_poses_s_ == 0 ? 1 : kOfNewest) * ((acquired - *newest).seconds() - between_poses_s_);
  if (!of_) return;
  const Transform<Camera, Tracker> camera_from_tracker = of_->camera_from_sensor() * tracker_from_sensor.inverse();
  const auto is_ahead = [](const Eigen::Vector3d& place_mm) {
    return place_mm.z() > kNearestSeen_mm && place_mm.norm() < kFarthest_mm;
  };
  if (!watched_mm_ || !is_ahead(camera_from_tracker * *watched_mm_)) {
    watched_mm_ = camera_from_tracker.inverse() * Eigen::Vector3d(0, 0, kAhead_mm);
    jitter_ = TargetJitter();
  }
  jitter_.push(acquired, camera_from_tracker * *watched_mm_);
}

/// One sigma of an axis, as if all noise were across the line of sight.
double VideoMotion::noise_of_average_px(const CameraModel& camera) const {
  const auto rms_mm = jitter_.rms_mm();
  if (!rms_mm || between_poses_s_ <= 0) return 0;
  const double averaged = std::max(1.0, 2 * kAverage.seconds() / between_poses_s_);
  return camera.fx_px / kAhead_mm * *rms_mm / std::sqrt(2 * averaged);
}

bool VideoMotion::take(const wire::VideoFrame& frame, const PictureToFollow& picture, const ScopeSetup& scope,
                       double farthest_mm) {
  const VideoAgreement before = state_;
  contradicted_ = false;
  if (of_ && !of_->sees_as(scope)) {
    reset();
    wanted_ = 1;  // another scope had differed, or its rod was turned since; a clock that goes back leaves this one's
  }
  of_ = scope;
  const DeviceTime at = frame.info.acquired;
  if (waiting_) {
    const auto newest = poses_.newest();
    if (newest && *newest >= waiting_->at + kAverage + kAverage) {
      look(*waiting_, scope);
      waiting_.reset();
    } else if (at - waiting_->at > kEvery || at < waiting_->at) {
      if (key_ && !key_->from) key_.reset();
      waiting_.reset();  // no poses come
    }
  }
  const CameraModel& camera = scope.camera();
  if (frame.width_px == camera.width_px && frame.height_px == camera.height_px) {
    if (key_) follow(at, picture);
    const bool due = !looked_at_ || at - *looked_at_ >= kEvery || at < *looked_at_;
    if (!waiting_ && due) {
      looked_at_ = at;
      wait(frame, picture, farthest_mm);
    }
  }
  return state_ != before;
}

/// Until the poses after the frame have come.
void VideoMotion::wait(const wire::VideoFrame& frame, const PictureToFollow& picture, double farthest_mm) {
  waiting_ = std::make_unique<Waiting>();
  waiting_->at = frame.info.acquired;
  waiting_->farthest_mm = farthest_mm;
  waiting_->times_apart_s = times_apart_s(
      Duration::from_seconds(std::hypot(frame.info.acquired_sigma.seconds(), frame.info.pose.time_sigma.seconds())),
      frame.info.latency.has_value());
  if (!key_) return begin_key(*waiting_, picture, std::nullopt);
  // What is followed from frame to frame drifts with each: they only tell where to look, from the last that was looked
  // at.
  const std::size_t kept = keep(follow_places(key_->looked_at, picture, key_->looked, &key_->now));
  // Where most are lost at once the picture is another, and what is left is chance.
  if (2 * kept < std::exchange(key_->kept, kept)) {
    if (state_ == VideoAgreement::agrees || state_ == VideoAgreement::in_doubt) forget_agreement();
    key_.reset();
    waiting_.reset();
    return;
  }
  key_->looked_at = picture;
  key_->looked = key_->now;
  waiting_->then = key_->places;
  waiting_->now = key_->now;
  waiting_->farthest_step_px = std::exchange(key_->farthest_step_px, 0);
  waiting_->longest_step = std::exchange(key_->longest_step, Duration{0});
}

void VideoMotion::begin_key(const Waiting& waiting, const PictureToFollow& picture,
                            const std::optional<SeenFrom>& from) {
  auto key = std::make_unique<Key>();
  key->at = key->newest_at = key->judged_at = waiting.at;
  key->farthest_mm = waiting.farthest_mm;
  key->from = key->looked_from = from;
  key->places = key->looked = key->now = distinct_places_to_follow(picture.grey);
  key->kept = key->places.size();
  key->looked_at = key->newest = picture;
  key_ = std::move(key);
}

/// Of the key's places those that were found, and where.
std::size_t VideoMotion::keep(const std::vector<std::optional<cv::Point2f>>& found) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!found[i]) continue;
    key_->places[kept] = key_->places[i];
    key_->looked[kept] = key_->looked[i];
    key_->now[kept++] = *found[i];
  }
  key_->places.resize(kept);
  key_->looked.resize(kept);
  key_->now.resize(kept);
  return kept;
}

std::optional<VideoMotion::SeenFrom> VideoMotion::seen_from(const Waiting& waiting, const ScopeSetup& scope) const {
  std::array<std::optional<Transform<Camera, Tracker>>, 3> at;  // before, at and after the picture
  for (std::size_t i = 0; i < at.size(); ++i) {
    const PoseAnswer pose = poses_.at(waiting.at + Duration{(static_cast<std::int64_t>(i) - 1) * kAverage.ns});
    if (!pose.tracker_from_sensor || pose.kind == PoseKind::predicted) return std::nullopt;
    at[i] = scope.camera_from_sensor() * pose.tracker_from_sensor->inverse();
  }
  SeenFrom out{waiting.at, *at[1]};
  // Where the camera speeds up the average of its poses is off, and where it is fast so is what it sees of another
  // time.
  const Transform<Tracker, Camera> back = at[1]->inverse();
  for (const Eigen::Vector3d& place_mm : places_ahead_mm()) {
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

void VideoMotion::look(const Waiting& waiting, const ScopeSetup& scope) {
  if (!key_) return;  // lost since
  const auto from = seen_from(waiting, scope);
  if (!from) {
    if (!key_->from) key_.reset();
    return;  // the key stays: what moves while no pose comes must not lie between two keys
  }
  if (!key_->from) {
    key_->from = key_->looked_from = from;
    return;
  }
  const double small_px = static_cast<double>(scope.camera().width_px) / key_->newest.grey.cols;
  // Poses that leap, as of a transmitter that is bumped, are no haste: the places do not go with them.
  const double poses_step_px = fastest_px_s(*std::exchange(key_->looked_from, from), *from, scope.camera()) / small_px *
                               waiting.longest_step.seconds();
  const bool hasty = poses_step_px > kFarthestStepPx && waiting.farthest_step_px > kOfHaste * poses_step_px;
  const bool lost = hasty || waiting.then.size() < kFewest;
  const Judged judged = lost ? Judged::not_odd : judge(waiting, *from, scope);
  // Places that are nearly off are followed for three seconds more, and those on their way there for one: the next
  // pictures tell.
  const Duration age = waiting.at - key_->at;
  const bool nearly_off = key_->off > kNearlyOff && age < kLongest + kLongest;
  const bool on_the_way = key_->off > kOnTheWay && age < kLongest + kOnTheWayFor;
  const bool calmer = !nearly_off && key_->from->unsure_px > std::max(2 * from->unsure_px, kHastePx * small_px);
  // Not while the poses leave much open: what leaps then would lie between two keys.
  const bool old = !nearly_off && !on_the_way && age >= kLongest && from->unsure_px <= kHastePx * small_px;
  const bool renew = judged == Judged::odd ? odd_ >= kOddInRow : judged == Judged::of_what_is_left || calmer || old;
  if (!lost && !renew) return;
  // The next key begins where these places have come to: what moved them is not seen in any later picture.
  const bool unjudged = waiting.at - key_->judged_at > kUnjudged;
  if (judged == Judged::not_odd && (unjudged || key_->off > kNearlyOff)) {
    told_ = {};
    if (state_ != VideoAgreement::differs) state_ = VideoAgreement::untold;
  }
  // From the picture that was judged, so that no motion lies between two keys.
  const PictureToFollow newest = key_->newest;
  const DeviceTime newest_at = key_->newest_at;
  begin_key(waiting, PictureToFollow(key_->looked_at), from);
  if (newest.grey.data != key_->looked_at.grey.data) {
    keep(follow_places(key_->looked_at, newest, key_->places));
    key_->newest = newest;
    key_->newest_at = newest_at;
  }
}

/// To the next picture; what is not found there, or leads back to another place, is let go.
void VideoMotion::follow(DeviceTime at, const PictureToFollow& picture) {
  if (key_->newest.grey.size() != picture.grey.size()) return key_.reset();
  const auto there = follow_places(key_->newest, picture, key_->now);
  std::vector<double> steps_px;
  steps_px.reserve(there.size());
  for (std::size_t i = 0; i < there.size(); ++i)
    if (there[i]) steps_px.push_back(cv::norm(*there[i] - key_->now[i]));
  // A flash, or smoke: the next frame may show them again. Where it does not, the next look tells.
  if (steps_px.empty() || 2 * steps_px.size() < there.size()) return;
  key_->farthest_step_px = std::max(key_->farthest_step_px, median_of(std::move(steps_px)));
  keep(there);
  key_->newest = picture;
  key_->longest_step = std::max(key_->longest_step, at - key_->newest_at);
  key_->newest_at = at;
}

/// Of places ahead of the camera, from one picture to the next that was looked at: what goes and stops between them is
/// at its fastest twice as fast as on the average.
double VideoMotion::fastest_px_s(const SeenFrom& then, const SeenFrom& now, const CameraModel& camera) {
  const auto now_from_then = now.camera_from_tracker * then.camera_from_tracker.inverse();
  double farthest = 0;
  for (const Eigen::Vector3d& place_mm : places_ahead_mm()) {
    const Eigen::Vector3d there = now_from_then * place_mm;
    const double z_mm = std::max(there.z(), kNearestSeen_mm);
    farthest = std::max(farthest, (there.head<2>() / z_mm - place_mm.hnormalized()).norm());
  }
  return 2 * camera.fx_px * farthest / std::max((now.at - then.at).seconds(), 1e-3);
}

/// odd: the places do not lie where the poses say. of_what_is_left: the same, but a quick motion has lost more than a
/// third of them, and the rest may have been followed to others that look alike; or some agree, and no motion at all
/// has the rest where it lies. Then state() becomes untold, not differs, and the video has to agree anew about each
/// axis. The latter does not contradict either: places on rims and reflections do not go with the tissue, and are the
/// last to be lost.
VideoMotion::Judged VideoMotion::judge(const Waiting& waiting, const SeenFrom& now, const ScopeSetup& scope) {
  const auto& held_out_px = scope.figures().held_out_px;
  if (!held_out_px) return Judged::not_odd;  // nothing says how far off a picture may be
  const CameraModel& camera = scope.camera();
  const int columns = key_->newest.grey.cols;
  std::vector<FollowedPlace> places;
  places.reserve(waiting.then.size());
  for (std::size_t i = 0; i < waiting.then.size(); ++i) {
    const auto then = ray_of(camera, columns, waiting.then[i]), later = ray_of(camera, columns, waiting.now[i]);
    if (then && later) places.push_back({*then, *later});
  }
  if (places.size() < kFewest) return Judged::not_odd;
  const Relative motion = now.camera_from_tracker * key_->from->camera_from_tracker.inverse();
  const auto median_off = median_off_line(places, motion, key_->farthest_mm);
  if (!median_off) return Judged::not_odd;
  off_px_ = *median_off * camera.fx_px;
  std::array<double, 3> otherwise_px{};  // by axis, how far off they would be with a hand-eye that is turned about it
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const auto off_if_turned = median_off_if_turned(places, motion, axis, kTurned_rad);
    otherwise_px[static_cast<std::size_t>(axis)] = off_if_turned.value_or(0) * camera.fx_px;
  }
  const double scale = static_cast<double>(camera.width_px) / columns;
  // The errors of hand-eye and of two poses, of two axes, with a probability of 99.9 %, for many pictures are asked;
  // how well a place is found; how sure the two poses are; and what of the motion itself is not as it is modelled.
  // Hand-eye is held out at poses of a scope at rest, which averaged longer.
  const double sigma_px = std::hypot(*held_out_px, std::sqrt(2) * noise_of_average_px(camera));
  const double still_px =
      std::hypot(std::hypot(std::sqrt(13.8) * sigma_px, kFollowedPx * scale), now.unsure_px + key_->from->unsure_px);
  const double allowed_px = std::hypot(still_px, kNotModelled * *std::ranges::max_element(otherwise_px));
  key_->off = *off_px_ / allowed_px;
  key_->judged_at = waiting.at;
  if (*off_px_ > allowed_px) {
    if (odd_ == 0) key_->left = waiting.then.size();
    odd_ += *off_px_ > kPlainly * allowed_px ? kOddInRow : 1;
    if (odd_ < kOddInRow) {
      // The next pictures tell. Until then nothing says that this one is right.
      if (state_ == VideoAgreement::agrees) state_ = VideoAgreement::in_doubt;
      return Judged::odd;
    }
    const bool swung = 3 * key_->left < 2 * key_->agreed;
    const bool moved = *off_px_ > kPlainly * allowed_px ||
                       few_agree(places, motion, allowed_px / camera.fx_px, key_->farthest_mm) ||
                       go_as_one(places, kFollowedPx * scale / std::sqrt(2) / camera.fx_px);
    contradicted_ = swung || moved;
    told_ = {};
    if (swung || !moved) {
      if (state_ != VideoAgreement::differs) state_ = VideoAgreement::untold;
      odd_ = 0;
      return Judged::of_what_is_left;
    }
    if (state_ != VideoAgreement::differs) wanted_ = std::min(2 * wanted_, kMostWanted);
    state_ = VideoAgreement::differs;
    return Judged::odd;
  }
  odd_ = 0;
  if (now.unsure_px < kHastePx * scale) key_->agreed = waiting.then.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!(otherwise_px[axis] > std::max(still_px, kPlainly * *off_px_))) continue;
    if (!std::exchange(key_->told[axis], true)) ++told_[axis];
  }
  if (doubted_since_ && waiting.at < *doubted_since_) return Judged::not_odd;
  if (state_ == VideoAgreement::in_doubt && key_->off > kNearlyOff)
    return Judged::not_odd;  // such a picture ends no doubt
  if (std::ranges::all_of(told_, [this](int times) { return times >= wanted_; })) state_ = VideoAgreement::agrees;
  return Judged::not_odd;
}

}  // namespace birdseye::host
