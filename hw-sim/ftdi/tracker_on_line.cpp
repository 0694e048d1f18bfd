#include "hw-sim/ftdi/tracker_on_line.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <utility>

namespace birdseye::hw_sim {

TrackerOnLine::TrackerOnLine(const Settings& settings, DeviceTime zero)
    : settings_(settings), unit_(settings.unit), zero_(zero), measured_(zero), ready_(zero + settings.boot) {}

void TrackerOnLine::receive(std::span<const std::uint8_t> bytes, DeviceTime now) {
  if (held_ || now < ready_) return;
  for (const std::uint8_t byte : bytes) {
    const auto part = unit_.receive(byte);
    reply_.insert(reply_.end(), part.begin(), part.end());
  }
}

std::vector<std::uint8_t> TrackerOnLine::send(DeviceTime now) {
  std::vector<std::uint8_t> bytes = std::exchange(reply_, {});
  while (next_send() <= now) {
    if (!held_ && measured_ >= ready_) {
      const auto record = unit_.measure(poses(measured_));
      bytes.insert(bytes.end(), record.begin(), record.end());
    }
    measured_ = measured_ + Duration::from_seconds(1 / unit_.rate_hz());
  }
  return bytes;
}

void TrackerOnLine::set_reset(bool held, DeviceTime now) {
  if (std::exchange(held_, held) && !held) ready_ = now + settings_.boot;
  if (!held) return;
  unit_.reset();
  reply_.clear();
}

std::vector<BirdPose> TrackerOnLine::poses(DeviceTime time) const {
  std::vector<BirdPose> poses(static_cast<std::size_t>(settings_.unit.birds));
  const double turn = std::numbers::pi * (time - zero_).seconds();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const double angle = turn + static_cast<double>(i);
    poses[i].rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    poses[i].position_mm = Eigen::Vector3d(400 + 200 * std::cos(angle), 200 * std::sin(angle), 0);
  }
  return poses;
}

}  // namespace birdseye::hw_sim
