#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/latency/latency.hpp"

/// A hand that turns a scope to and fro, and what a tracker and a camera make of it.
namespace birdseye::calibration::simulated {

/// Never twice alike: three axes, each a sum of sines whose pace wanders.
class Hand {
 public:
  explicit Hand(unsigned seed, double amplitude_deg = 15) : amplitude_rad_(amplitude_deg * kRadPerDeg) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    for (auto& axis : waves_) {
      for (Wave& wave : axis)
        wave = {0.3 + 0.9 * unit(random), 2 * std::numbers::pi * unit(random), 0.4 + unit(random)};
    }
  }
  [[nodiscard]] Eigen::Quaterniond rotation(double t) const {
    Eigen::Vector3d v;
    for (int k = 0; k < 3; ++k) {
      v[k] = 0;
      for (const Wave& w : waves_[k])
        v[k] += 0.6 * amplitude_rad_ * w.size *
                std::sin(2 * std::numbers::pi * w.hz * t + w.phase + 0.5 * std::sin(0.37 * t * w.hz));
    }
    v[2] *= 0.5;
    return Eigen::Quaterniond(rotation_exp(v));
  }
  /// Of the bird, 280 mm behind a point that the scope turns about.
  [[nodiscard]] Eigen::Vector3d place(double t) const {
    return Eigen::Vector3d(300, 20, -100) + rotation(t) * Eigen::Vector3d(10, -14, -280);
  }

 private:
  struct Wave {
    double hz = 1, phase = 0, size = 1;
  };
  Wave waves_[3][2];
  double amplitude_rad_;
};

struct StreamSettings {
  double begin_s = 0, seconds = 20, rate_hz = 100;
  double noise_deg = 0;                                   ///< per axis
  double time_jitter_ms = 0;                              ///< of the moments, which the stamps know
  double stamp_jitter_ms = 0;                             ///< of the stamps, about what is true
  double offset_ms = 0, drift_ppm = 0, drift_from_s = 0;  ///< of its clock
  unsigned seed = 1;
  Eigen::Quaterniond body = Eigen::Quaterniond::Identity();  ///< hand's body from this stream's
  Eigen::Quaterniond base = Eigen::Quaterniond::Identity();  ///< this stream's base from the hand's
};

using Rotations = std::vector<TimedRotation>;

inline Rotations record(const std::function<Eigen::Quaterniond(double)>& hand, const StreamSettings& s) {
  std::mt19937 random(s.seed);
  std::normal_distribution<double> normal;
  Rotations rows;
  const int count = static_cast<int>(s.seconds * s.rate_hz);
  for (int n = 0; n < count; ++n) {
    const double t = s.begin_s + n / s.rate_hz + 1e-3 * s.time_jitter_ms * normal(random);
    const Eigen::Vector3d noise =
        s.noise_deg * kRadPerDeg * Eigen::Vector3d(normal(random), normal(random), normal(random));
    const double stamp =
        t + 1e-3 * s.offset_ms + 1e-6 * s.drift_ppm * (t - s.drift_from_s) + 1e-3 * s.stamp_jitter_ms * normal(random);
    rows.push_back({stamp, s.base * hand(t) * s.body * Eigen::Quaterniond(rotation_exp(noise))});
  }
  return rows;
}
inline Rotations record(const Hand& hand, const StreamSettings& s) {
  return record([&hand](double t) { return hand.rotation(t); }, s);
}

/// The bird's poses with their places; noise_mm: per axis.
inline std::vector<TimedMotionPose> record_poses(const Hand& hand, const StreamSettings& s, double noise_mm) {
  std::mt19937 random(s.seed + 7);
  std::normal_distribution<double> normal;
  std::vector<TimedMotionPose> poses;
  const Rotations rows = record(hand, s);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    const double t = s.begin_s + static_cast<double>(n) / s.rate_hz;
    const Eigen::Vector3d noise(normal(random), normal(random), normal(random));
    poses.push_back({rows[n].time_s, rows[n].base_from_body, hand.place(t) + noise_mm * noise});
  }
  return poses;
}

/// What a camera joined to the hand sees of a wall 95 mm before it: how the wall's points before the lens move, which
/// no linear map of the bird's steps makes exactly. noise_px: of each of the four figures.
inline std::vector<ImageMotion> film(const Hand& hand, const StreamSettings& s, double noise_px) {
  std::mt19937 random(s.seed + 11);
  std::normal_distribution<double> normal;
  constexpr double kFocalPx = 600, kRadiusPx = 240, kWallMm = 95;
  const Eigen::Vector3d lens_in_body(6, -14, 280), normal_of_wall(0.1, -0.2, 1);
  struct Moment {
    double stamp_s;
    Eigen::Matrix3d rotation;
    Eigen::Vector3d eye;
  };
  std::vector<Moment> moments;
  const int count = static_cast<int>(s.seconds * s.rate_hz);
  for (int n = 0; n < count; ++n) {
    const double t = s.begin_s + n / s.rate_hz + 1e-3 * s.time_jitter_ms * normal(random);
    const Eigen::Quaterniond q = hand.rotation(t);
    const double stamp =
        t + 1e-3 * s.offset_ms + 1e-6 * s.drift_ppm * (t - s.drift_from_s) + 1e-3 * s.stamp_jitter_ms * normal(random);
    moments.push_back({stamp, (q * s.body).toRotationMatrix(), hand.place(t) + q * lens_in_body});
  }
  // The wall stands before the camera of the middle of the film.
  const Moment& middle = moments[moments.size() / 2];
  const Eigen::Vector3d wall_normal = middle.rotation * normal_of_wall.normalized();
  const double wall_at = wall_normal.dot(middle.eye + middle.rotation * Eigen::Vector3d(0, 0, kWallMm));
  std::vector<ImageMotion> rows;
  for (std::size_t n = 1; n < moments.size(); ++n) {
    const Moment &from = moments[n - 1], &to = moments[n];
    // Four points about the middle of the picture, seen again: shift, turn and growth by least squares.
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (const Eigen::Vector2d& at : {Eigen::Vector2d(kRadiusPx, 0), Eigen::Vector2d(-kRadiusPx, 0),
                                      Eigen::Vector2d(0, kRadiusPx), Eigen::Vector2d(0, -kRadiusPx)}) {
      const Eigen::Vector3d ray = from.rotation * Eigen::Vector3d(at.x() / kFocalPx, at.y() / kFocalPx, 1);
      const Eigen::Vector3d point = from.eye + ray * (wall_at - wall_normal.dot(from.eye)) / wall_normal.dot(ray);
      const Eigen::Vector3d seen = to.rotation.transpose() * (point - to.eye);
      const Eigen::Vector2d moved = kFocalPx * seen.head<2>() / seen.z() - at;
      const Eigen::Vector2d out = at / kRadiusPx, round(-out.y(), out.x());
      sum += Eigen::Vector4d(moved.x(), moved.y(), moved.dot(round), moved.dot(out)) / 4;
    }
    for (int k = 0; k < 4; ++k) sum[k] += noise_px * normal(random);
    rows.push_back({from.stamp_s, to.stamp_s, sum});
  }
  return rows;
}

}  // namespace birdseye::calibration::simulated
