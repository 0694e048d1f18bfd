#include "calibration/guide/still_detector.hpp"

#include <vector>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

void StillDetector::push(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  if (!tracker_from_sensor.matrix().allFinite()) return;
  recent_.push_back({acquired, tracker_from_sensor});
  while (recent_.back().acquired - recent_.front().acquired > settings_.kept) recent_.pop_front();
}

bool StillDetector::still_at(DeviceTime time) const {
  // Two halves of the window, averaged: at rest their means agree but for noise.
  const DeviceTime middle = time - Duration{(settings_.before.ns - settings_.after.ns) / 2};
  Eigen::Vector3d place[2] = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  Eigen::Matrix3d turn[2] = {Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero()};
  int count[2] = {0, 0};
  for (const Sample& s : recent_) {
    if (s.acquired < time - settings_.before || s.acquired > time + settings_.after) continue;
    const std::size_t half = s.acquired < middle ? 0 : 1;
    place[half] += s.pose.translation();
    turn[half] += s.pose.rotation();
    ++count[half];
  }
  if (count[0] < 2 || count[1] < 2) return false;
  return (place[0] / count[0] - place[1] / count[1]).norm() < settings_.still_mm &&
         rotation_angle_between(nearest_rotation(turn[0]), nearest_rotation(turn[1])) < settings_.still_rad;
}

std::optional<Rest> StillDetector::rest_between(DeviceTime first, DeviceTime last) const {
  constexpr std::size_t kFewest = 4;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  std::vector<const Sample*> used;
  for (const Sample& s : recent_) {
    if (s.acquired < first || s.acquired > last) continue;
    place += s.pose.translation();
    turn += s.pose.rotation();
    used.push_back(&s);
  }
  if (used.size() < kFewest) return std::nullopt;
  place /= static_cast<double>(used.size());
  Rest rest{{nearest_rotation(turn), place}, used.size()};
  for (const Sample* s : used) {
    rest.position_squares_mm2 += (s->pose.translation() - place).squaredNorm() / 3;
    const double angle = rotation_angle_between(rest.tracker_from_sensor.rotation(), s->pose.rotation());
    rest.angle_squares_rad2 += angle * angle / 3;
  }
  return rest;
}

}  // namespace birdseye::calibration
