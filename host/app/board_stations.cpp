#include "host/app/board_stations.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "host/app/picture.hpp"

namespace birdseye::host {

namespace {

constexpr Duration kKept = Duration::from_ms(1500);
constexpr Duration kBefore = Duration::from_ms(60), kAfter = Duration::from_ms(40);
// Beyond what the fitted motion of a noisy tracker at rest reaches; a move to another station is many times as much.
constexpr double kStillMm = 3, kStillRad = 1.0 * kRadPerDeg;
constexpr std::size_t kFewestFrames = 3, kMostFrames = 40;

/// The rotation nearest to the mean of the matrices.
Eigen::Matrix3d mean_rotation(const Eigen::Matrix3d& sum) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

void BoardStations::push(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  recent_.push_back({acquired, tracker_from_sensor});
  while (recent_.back().acquired - recent_.front().acquired > kKept) recent_.pop_front();
}

bool BoardStations::at_rest(DeviceTime time) const {
  // Two halves of the window, averaged: at rest their means agree but for noise.
  Eigen::Vector3d place[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Eigen::Matrix3d turn[2] = {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  int count[2] = {0, 0};
  for (const Sample& s : recent_) {
    if (s.acquired < time - kBefore || s.acquired > time + kAfter) continue;
    const std::size_t half = s.acquired < time - Duration{(kBefore.ns - kAfter.ns) / 2} ? 0 : 1;
    place[half] += s.pose.translation();
    turn[half] += s.pose.rotation();
    ++count[half];
  }
  if (count[0] < 2 || count[1] < 2) return false;
  return (place[0] / count[0] - place[1] / count[1]).norm() < kStillMm &&
         rotation_angle_between(mean_rotation(turn[0]), mean_rotation(turn[1])) < kStillRad;
}

void BoardStations::push(const wire::VideoFrame& frame) {
  if (at_rest(frame.info.acquired) && still_.size() < kMostFrames) {
    still_.push_back(frame);
  } else {
    finish();
  }
}

void BoardStations::finish() {
  std::vector<wire::VideoFrame> still;
  still.swap(still_);
  if (still.size() < kFewestFrames) return;
  const wire::VideoFrame& middle = still[still.size() / 2];
  const std::vector<std::uint8_t> grey = grey_of(*middle.rgb, middle.width_px, middle.height_px);
  auto view = calibration::find_board(
      board_, {grey.data(), middle.width_px, middle.height_px, static_cast<std::size_t>(middle.width_px)});
  if (!view) return;
  // The poses between the stretch's first and last frame, both of which had rest on either side.
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  std::vector<const Sample*> used;
  for (const Sample& s : recent_) {
    if (s.acquired < still.front().info.acquired || s.acquired > still.back().info.acquired) continue;
    place += s.pose.translation();
    turn += s.pose.rotation();
    used.push_back(&s);
  }
  if (used.size() < 4) return;
  place /= static_cast<double>(used.size());
  const Eigen::Matrix3d rotation = mean_rotation(turn);
  for (const Sample* s : used) {
    position_squares_ += (s->pose.translation() - place).squaredNorm() / 3;
    const double angle = rotation_angle_between(rotation, s->pose.rotation());
    angle_squares_ += angle * angle / 3;
  }
  samples_ += used.size();
  samples_per_station_ = used.size();
  views_.push_back(*std::move(view));
  poses_.emplace_back(rotation, place);
}

calibration::HandEyeSettings BoardStations::uncertainty() const {
  calibration::HandEyeSettings settings;
  if (samples_ == 0) return settings;
  const auto n = static_cast<double>(samples_);
  const auto per_station = static_cast<double>(samples_per_station_);
  // A unit's words are steps of a tenth of a millimetre: a scatter of nothing is not a knowledge of everything.
  constexpr double kStepMm = 0.1116, kStepRad = 1.22e-4;
  settings.position_sigma_mm = std::hypot(std::sqrt(position_squares_ / n / per_station), kStepMm / std::sqrt(12.0));
  settings.angle_sigma_rad = std::hypot(std::sqrt(angle_squares_ / n / per_station), kStepRad / std::sqrt(12.0));
  return settings;
}

}  // namespace birdseye::host
