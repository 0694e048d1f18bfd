#include "hw-sim/minibird/record_encoder.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace birdseye::hw_sim {

namespace {

/// value: in units of full scale. Rounded to the nearest count, saturated where the unit's outputs saturate.
std::int16_t word(double value) {
  return static_cast<std::int16_t>(std::clamp(std::lround(value * 32768.0), -32768L, 32767L));
}

}  // namespace

std::vector<std::int16_t> record_words(OutputFormat format, const BirdPose& pose, double full_scale_mm) {
  const Eigen::Matrix3d& r = pose.rotation;
  std::vector<std::int16_t> words;
  const auto position = [&] {
    for (int i = 0; i < 3; ++i) words.push_back(word(pose.position_mm[i] / full_scale_mm));
  };
  const auto angles = [&] {
    constexpr double kPerPi = 1.0 / std::numbers::pi;
    const double azimuth = std::atan2(r(1, 0), r(0, 0));
    const double elevation = std::atan2(-r(2, 0), std::hypot(r(0, 0), r(1, 0)));
    const double roll = std::atan2(r(2, 1), r(2, 2));
    for (const double angle : {azimuth, elevation, roll}) words.push_back(word(angle * kPerPi));
  };
  const auto matrix = [&] {
    // The unit sends M = R transposed, column by column: that is R row by row.
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) words.push_back(word(r(row, column)));
    }
  };
  const auto quaternion = [&] {
    // The wire carries the quaternion of M, the conjugate of the pose's.
    Eigen::Quaterniond q(r);
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    for (const double component : {q.w(), -q.x(), -q.y(), -q.z()}) words.push_back(word(component));
  };
  switch (format) {
    case OutputFormat::position:
      position();
      break;
    case OutputFormat::angles:
      angles();
      break;
    case OutputFormat::matrix:
      matrix();
      break;
    case OutputFormat::position_angles:
      position();
      angles();
      break;
    case OutputFormat::position_matrix:
      position();
      matrix();
      break;
    case OutputFormat::quaternion:
      quaternion();
      break;
    case OutputFormat::position_quaternion:
      position();
      quaternion();
      break;
  }
  return words;
}

std::vector<std::uint8_t> phased_bytes(const std::vector<std::int16_t>& words) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(words.size() * 2);
  for (const std::int16_t value : words) {
    const auto w = static_cast<std::uint16_t>(value);
    bytes.push_back(static_cast<std::uint8_t>((w >> 2) & 0x7F));
    bytes.push_back(static_cast<std::uint8_t>((w >> 9) & 0x7F));
  }
  if (!bytes.empty()) bytes.front() = static_cast<std::uint8_t>(bytes.front() | 0x80);
  return bytes;
}

}  // namespace birdseye::hw_sim
