#include "host/overlay/followed_places.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "calibration/base/median.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/picture/field_mask.hpp"
#include "calibration/picture/picture_mat.hpp"

namespace birdseye::host {

namespace {

using Relative = Transform<Camera, Camera>;

constexpr int kWidthPx = 320;
constexpr int kCandidates = 240;  // of which those that repeat are left out
constexpr double kThereAndBackPx = 0.7;
constexpr int kLevels = 3, kLevelsAbout = 1;
const cv::Size kWindow(15, 15);
constexpr int kAlikeFromPx = 6, kAlikeWithinPx = 20;  // nearer, it is the place itself; farther, none is followed to
constexpr double kAlike = 0.9;                        // correlation of grey values

/// From a place to a line's part between two others.
double distance(const Eigen::Vector2d& place, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  const Eigen::Vector2d along = to - from;
  const double squared = along.squaredNorm();
  const double share = squared > 0 ? std::clamp((place - from).dot(along) / squared, 0.0, 1.0) : 0.0;
  return (place - from - share * along).norm();
}

/// Whether a place looks as another that lies within reach of the search: on a board, or woven cloth, it may be
/// followed to that one. In half the size, which is enough for it.
bool repeats(const cv::Mat& half, const cv::Point2f& place) {
  constexpr int kPatch = 4, kReach = kPatch + kAlikeWithinPx / 2, kFrom = kAlikeFromPx / 2;
  const cv::Point at(cvRound(place.x / 2), cvRound(place.y / 2));
  const cv::Rect whole(0, 0, half.cols, half.rows);
  const cv::Rect patch(at.x - kPatch, at.y - kPatch, 2 * kPatch + 1, 2 * kPatch + 1);
  if ((patch & whole) != patch) return false;
  const cv::Rect about = cv::Rect(at.x - kReach, at.y - kReach, 2 * kReach + 1, 2 * kReach + 1) & whole;
  cv::Mat alike;
  cv::matchTemplate(half(about), half(patch), alike, cv::TM_CCOEFF_NORMED);
  // The place itself.
  const cv::Point self = patch.tl() - about.tl();
  alike(cv::Rect(self.x - kFrom, self.y - kFrom, 2 * kFrom + 1, 2 * kFrom + 1) & cv::Rect({}, alike.size())).setTo(0);
  double most = 0;
  cv::minMaxLoc(alike, nullptr, &most);
  return most >= kAlike;
}

bool is_flat(const cv::Mat& grey) {
  double least = 0, most = 0;
  cv::minMaxLoc(grey, &least, &most);
  return least == most;
}

}  // namespace

PictureToFollow picture_to_follow(const wire::VideoFrame& frame) {
  const cv::Mat rgb = mat_of(RgbView{*frame.rgb, frame.width_px, frame.height_px});
  const double scale = std::max(1.0, static_cast<double>(frame.width_px) / kWidthPx);
  PictureToFollow out;
  cv::Mat grey;
  cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
  cv::resize(grey, out.grey, {}, 1 / scale, 1 / scale, cv::INTER_AREA);
  if (!is_flat(out.grey)) cv::buildOpticalFlowPyramid(out.grey, out.pyramid, kWindow, kLevels);
  return out;
}

std::vector<cv::Point2f> places_to_follow(const cv::Mat& grey, int at_most) {
  if (is_flat(grey)) return {};  // to look for them takes longest where there are none
  cv::Mat mask = field_mask(grey.size());
  cv::Mat glare = grey > 240;
  cv::dilate(glare, glare, cv::Mat(), {-1, -1}, 3);
  mask.setTo(0, glare);
  std::vector<cv::Point2f> places;
  cv::goodFeaturesToTrack(grey, places, at_most, 0.01, 8, mask);
  return places;
}

std::vector<cv::Point2f> distinct_places_to_follow(const cv::Mat& grey) {
  const std::vector<cv::Point2f> candidates = places_to_follow(grey, kCandidates);
  std::vector<cv::Point2f> places;
  cv::Mat half;
  cv::resize(grey, half, {}, 0.5, 0.5, cv::INTER_AREA);
  std::size_t asked = 0;
  for (; asked < candidates.size() && places.size() < static_cast<std::size_t>(kPlaces); ++asked)
    if (!repeats(half, candidates[asked])) places.push_back(candidates[asked]);
  // Of a board that fills the picture, what is left is hardly better.
  if (4 * places.size() < asked) places.clear();
  return places;
}

std::vector<std::optional<cv::Point2f>> follow_places(const PictureToFollow& from, const PictureToFollow& to,
                                                      const std::vector<cv::Point2f>& places,
                                                      const std::vector<cv::Point2f>* about) {
  std::vector<std::optional<cv::Point2f>> out(places.size());
  if (places.empty() || from.grey.size() != to.grey.size() || from.pyramid.empty() || to.pyramid.empty()) return out;
  std::vector<cv::Point2f> there, back;
  int levels = kLevels, flags = 0;
  if (about != nullptr) {
    there = *about;
    back = places;
    levels = kLevelsAbout;
    flags = cv::OPTFLOW_USE_INITIAL_FLOW;
  }
  const cv::TermCriteria enough(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 30, 0.01);
  std::vector<std::uint8_t> found, found_back;
  std::vector<float> unused;
  cv::calcOpticalFlowPyrLK(from.pyramid, to.pyramid, places, there, found, unused, kWindow, levels, enough, flags);
  cv::calcOpticalFlowPyrLK(to.pyramid, from.pyramid, there, back, found_back, unused, kWindow, levels, enough, flags);
  for (std::size_t i = 0; i < places.size(); ++i)
    if (found[i] != 0 && found_back[i] != 0 && cv::norm(back[i] - places[i]) <= kThereAndBackPx) out[i] = there[i];
  return out;
}

std::optional<Eigen::Vector3d> ray_of(const CameraModel& camera, int small_columns, const cv::Point2f& place) {
  const double scale = static_cast<double>(camera.width_px) / small_columns;
  return unproject(camera, Eigen::Vector2d((place.x + 0.5) * scale - 0.5, (place.y + 0.5) * scale - 0.5));
}

std::vector<double> off_line(const std::vector<FollowedPlace>& places, const Relative& now_from_then,
                             double farthest_mm) {
  std::vector<double> off;
  off.reserve(places.size());
  for (const FollowedPlace& place : places) {
    // From the nearest depth on at which the place is before the camera in both pictures.
    const double ahead = (now_from_then.rotation() * place.then).z();
    if (!(ahead > 0)) continue;
    const double nearest_mm = std::max(kNearestSeen_mm, (kNearestSeen_mm - now_from_then.translation().z()) / ahead);
    if (nearest_mm >= farthest_mm) continue;
    const Eigen::Vector3d nearest = now_from_then * Eigen::Vector3d(nearest_mm * place.then);
    const Eigen::Vector3d farthest = now_from_then * Eigen::Vector3d(farthest_mm * place.then);
    off.push_back(distance(place.now.hnormalized(), nearest.hnormalized(), farthest.hnormalized()));
  }
  return off;
}

std::optional<double> median_off_line(const std::vector<FollowedPlace>& places, const Relative& now_from_then,
                                      double farthest_mm) {
  std::vector<double> off = off_line(places, now_from_then, farthest_mm);
  if (2 * off.size() <= places.size()) return std::nullopt;
  return median_of(std::move(off));
}

std::optional<double> median_off_if_turned(const std::vector<FollowedPlace>& places, const Relative& now_from_then,
                                           Eigen::Index axis, double by_rad) {
  std::optional<double> least;
  for (const double side_rad : {by_rad, -by_rad}) {
    const Relative turn(rotation_exp(Eigen::Vector3d(side_rad * Eigen::Vector3d::Unit(axis))), Eigen::Vector3d::Zero());
    const auto off = median_off_line(places, turn * now_from_then * turn.inverse());
    if (!off) return std::nullopt;
    least = std::min(least.value_or(*off), *off);
  }
  return least;
}

bool go_as_one(const std::vector<FollowedPlace>& places, double within) {
  constexpr std::size_t kFitted = 5;  // any five lie on the lines of some motion, so they tell nothing
  constexpr double kByChance = 0.45;  // of the others lie so on the average where many were followed wrongly
  constexpr double kSigmas = 2.3;     // more than that
  constexpr int kTries = 100;         // where seven tenths go as one, all tries miss them in one case of 10^8
  constexpr double kConfidence = 0.999;
  if (places.size() <= kFitted) return false;
  std::vector<cv::Point2d> then, now;
  then.reserve(places.size());
  now.reserve(places.size());
  for (const FollowedPlace& place : places) {
    then.emplace_back(place.then.x() / place.then.z(), place.then.y() / place.then.z());
    now.emplace_back(place.now.x() / place.now.z(), place.now.y() / place.now.z());
  }
  cv::Mat near;
  const cv::Mat essential =
      cv::findEssentialMat(then, now, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC, kConfidence, within, kTries, near);
  if (essential.empty()) return false;
  const auto others = static_cast<double>(places.size() - kFitted);
  const double by_chance = kByChance * others + kSigmas * std::sqrt(kByChance * (1 - kByChance) * others);
  return cv::countNonZero(near) - static_cast<double>(kFitted) >= by_chance;
}

}  // namespace birdseye::host
