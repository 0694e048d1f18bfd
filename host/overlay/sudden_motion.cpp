#include "host/overlay/sudden_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/base/median.hpp"
#include "calibration/base/units.hpp"
#include "host/overlay/followed_places.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kSpan = Duration::from_ms(200), kGap = Duration::from_ms(130);
constexpr std::size_t kFewest = 15, kFewestPoses = 10, kMostPoses = 64;
constexpr double kNear_mm = 60;  // where a place may lie: nearer, a pose's noise has it further off
constexpr double kSigmas = 4;    // of two axes together: one frame in 3000 by chance, and then it takes a moment only
constexpr double kTurned_rad = 15 * kRadPerDeg;
constexpr double kNotModelled = 0.15;  // as VideoMotion has it

}  // namespace

/// A frame, and where it was seen from.
struct SuddenMotion::Seen {
  DeviceTime at;
  Transform<Camera, Tracker> camera_from_tracker;
  double sigma = 0;  ///< of places by its pose, each axis, of unit focal length
  double times_apart_s = 0;
  double farthest_mm = kFarthestSeen_mm;
  std::vector<std::optional<cv::Point2f>> places{};  ///< those that are followed; empty: lost
};

struct SuddenMotion::Tracks {
  PictureToFollow newest;
  std::deque<Seen> seen;
  std::size_t chosen = 0;
};

SuddenMotion::SuddenMotion() = default;

SuddenMotion::~SuddenMotion() = default;
SuddenMotion::SuddenMotion(SuddenMotion&&) noexcept = default;
SuddenMotion& SuddenMotion::operator=(SuddenMotion&&) noexcept = default;

void SuddenMotion::take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  if (!newest_.empty() && (acquired <= newest_.back().first || acquired - newest_.back().first > kGap)) newest_.clear();
  newest_.emplace_back(acquired, tracker_from_sensor);
  if (newest_.size() < 3) return;
  const double u = (newest_[1].first - newest_[0].first).seconds() / (acquired - newest_[0].first).seconds();
  if (of_) {
    std::array<Eigen::Vector2d, 3> place;  // that is ahead of the camera by the pose in the middle
    const Transform<Tracker, Camera> back = newest_[1].second * of_->camera_from_sensor().inverse();
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d in_camera_mm =
          of_->camera_from_sensor() * newest_[i].second.inverse() * (back * Eigen::Vector3d(0, 0, kNear_mm));
      place[i] = in_camera_mm.head<2>() / std::max(in_camera_mm.z(), kNearestSeen_mm);
    }
    const Eigen::Vector2d off = place[1] - (1 - u) * place[0] - u * place[2];
    squares_.push_back(off.squaredNorm() / (1 + (1 - u) * (1 - u) + u * u));  // the variances of all three add up
    if (squares_.size() > kMostPoses) squares_.pop_front();
  }
  newest_.pop_front();
}

/// Of single poses, each axis, of unit focal length. By the median: a jump is no scatter.
double SuddenMotion::scatter() const {
  if (squares_.size() < kFewestPoses) return 0;
  return std::sqrt(median_of(std::vector<double>(squares_.begin(), squares_.end())) / (2 * std::log(2.0)));
}

std::optional<SuddenMotion::Seen> SuddenMotion::seen(const wire::VideoFrame& frame, const ScopeSetup& scope) const {
  const PoseAnswer& pose = frame.info.pose;
  if (!pose.tracker_from_sensor || frame.width_px != scope.camera().width_px ||
      frame.height_px != scope.camera().height_px)
    return std::nullopt;
  return Seen{
      frame.info.acquired, scope.camera_from_sensor() * pose.tracker_from_sensor->inverse(),
      std::max(scatter(), pose.position_sigma_mm / kNear_mm),
      times_apart_s(Duration::from_seconds(std::hypot(frame.info.acquired_sigma.seconds(), pose.time_sigma.seconds())),
                    frame.info.latency.has_value())};
}

bool SuddenMotion::take(const wire::VideoFrame& frame, const PictureToFollow& picture, const ScopeSetup& scope,
                        std::optional<double> target_mm) {
  if (of_ && !of_->sees_as(scope)) {
    tracks_.reset();
    squares_.clear();
  }
  of_ = scope;
  auto now = seen(frame, scope);
  if (!now) {
    tracks_.reset();
    return false;
  }
  if (target_mm) now->farthest_mm = std::clamp(2 * *target_mm, 2 * kNearestSeen_mm, kFarthestSeen_mm);
  if (tracks_) {
    const Seen& last = tracks_->seen.back();
    if (now->at <= last.at || now->at - last.at > kGap || tracks_->newest.grey.size() != picture.grey.size())
      tracks_.reset();
  }
  bool sudden = false;
  if (tracks_) {
    const auto& before = tracks_->seen.back().places;
    std::vector<cv::Point2f> from;
    for (const auto& place : before)
      if (place) from.push_back(*place);
    const auto there = follow_places(tracks_->newest, picture, from);
    now->places.resize(before.size());
    std::size_t next = 0, found = 0;
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (!before[i]) continue;
      now->places[i] = there[next++];
      if (now->places[i]) ++found;
    }
    const bool lost = 2 * found < from.size();  // at once: the picture is another
    sudden = lost || differs(*now);
    if (lost || 2 * found < tracks_->chosen) tracks_.reset();
  }
  if (!tracks_) {
    const auto places = places_to_follow(picture.grey);
    if (places.size() < kFewest) return sudden;
    tracks_ = std::make_unique<Tracks>();
    tracks_->chosen = places.size();
    now->places.assign(places.begin(), places.end());
  }
  tracks_->newest = picture;
  tracks_->seen.push_back(std::move(*now));
  while (tracks_->seen.back().at - tracks_->seen.front().at > kSpan) tracks_->seen.pop_front();
  return sudden;
}

bool SuddenMotion::differs(const Seen& now) const {
  const Seen& then = tracks_->seen.front();
  const CameraModel& camera = of_->camera();
  const int columns = tracks_->newest.grey.cols;
  std::vector<FollowedPlace> places;
  places.reserve(now.places.size());
  for (std::size_t i = 0; i < now.places.size(); ++i) {
    if (!now.places[i] || !then.places[i]) continue;
    const auto before = ray_of(camera, columns, *then.places[i]), after = ray_of(camera, columns, *now.places[i]);
    if (before && after) places.push_back({*before, *after});
  }
  if (places.size() < kFewest || squares_.size() < kFewestPoses) return false;
  const Transform<Camera, Camera> motion = now.camera_from_tracker * then.camera_from_tracker.inverse();
  const auto off = median_off_line(places, motion, then.farthest_mm);
  if (!off) return false;
  double otherwise = 0;
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    otherwise = std::max(otherwise, median_off_if_turned(places, motion, axis, kTurned_rad).value_or(0));
  std::vector<double> moved;
  moved.reserve(places.size());
  for (const FollowedPlace& place : places) moved.push_back((place.now - place.then).norm());
  const double rate_s = median_of(std::move(moved)) / (now.at - then.at).seconds();
  const double small_px = static_cast<double>(camera.width_px) / columns / camera.fx_px;
  const double allowed =
      std::hypot(std::hypot(kSigmas * std::hypot(now.sigma, then.sigma), kFollowedPx * small_px),
                 std::hypot(2 * rate_s * std::hypot(now.times_apart_s, then.times_apart_s), kNotModelled * otherwise));
  return *off > allowed;
}

}  // namespace birdseye::host
