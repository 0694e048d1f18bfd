#pragma once

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/hand_eye/pose_streams.hpp"
#include "hw-sim/minibird/field_distortion.hpp"

namespace birdseye::testing {

/// A scope moved by hand over a board: the tracker's poses of its sensor and the camera's of the board, whose errors
/// last. Deviations are per axis.
struct HandEyeStreamScene {
  double seconds = 60, sensor_hz = 60, camera_hz = 20;
  double clock_offset_s = 0.03;
  double lasting_s = 1.5;  ///< after which an error has fallen to 1/e
  double position_mm = 0.5, angle_deg = 0.15, view_position_mm = 0.3, view_angle_deg = 0.1;
  double bent_mm = 1.5;  ///< at most, by the tracker's field
  unsigned seed = 1;
};

struct HandEyeStream {
  Transform<Camera, Sensor> camera_from_sensor;
  std::vector<calibration::StampedSensor> sensor;
  std::vector<calibration::StampedView> views;

  explicit HandEyeStream(const HandEyeStreamScene& scene) : rng_(scene.seed) {
    camera_from_sensor = {rotation_exp(Eigen::Vector3d(0.2, -1.5, 0.1)), Eigen::Vector3d(6, -14, -250)};
    const Transform<Tracker, Marker> tracker_from_marker(rotation_exp(Eigen::Vector3d(0.1, 0.1, 0.6)),
                                                         Eigen::Vector3d(330, -80, 140));
    for (auto& axis : waves_) {
      for (Wave& w : axis) w = {0.06 + 0.25 * unit_(rng_), 6.3 * unit_(rng_), 0.5 + unit_(rng_)};
    }
    const hw_sim::FieldDistortion field(scene.bent_mm, scene.seed);
    Lasting sensor_error(scene.position_mm, scene.angle_deg, scene.lasting_s);
    for (int n = 0; n < scene.seconds * scene.sensor_hz; ++n) {
      const double t = n / scene.sensor_hz;
      const auto pose = tracker_from_marker * view(t).inverse() * camera_from_sensor;
      const hw_sim::BirdPose bent = field.apply({pose.rotation(), pose.translation()});
      sensor.push_back({t, sensor_error.after(1 / scene.sensor_hz, rng_)
                               .applied(Transform<Tracker, Sensor>(bent.rotation, bent.position_mm))});
    }
    Lasting view_error(scene.view_position_mm, scene.view_angle_deg, scene.lasting_s);
    for (int n = 0; n < scene.seconds * scene.camera_hz; ++n) {
      const double t = n / scene.camera_hz;
      views.push_back({t - scene.clock_offset_s, view_error.after(1 / scene.camera_hz, rng_).applied(view(t))});
    }
  }

 private:
  struct Wave {
    double hz = 1, phase = 0, size = 1;
  };
  /// Of first order: each step keeps a share of the error and adds its own.
  class Lasting {
   public:
    Lasting(double position_mm, double angle_deg, double lasting_s)
        : position_mm_(position_mm), angle_rad_(angle_deg * kRadPerDeg), lasting_s_(lasting_s) {}
    Lasting& after(double seconds, std::mt19937& rng) {
      const double kept = std::exp(-seconds / lasting_s_);
      const double added = started_ ? std::sqrt(1 - kept * kept) : 1;
      for (double& e : error_) e = (started_ ? kept * e : 0) + added * normal_(rng);
      started_ = true;
      return *this;
    }
    template <typename To, typename From>
    [[nodiscard]] Transform<To, From> applied(const Transform<To, From>& pose) const {
      const Eigen::Vector3d turn = angle_rad_ * Eigen::Vector3d(error_[0], error_[1], error_[2]);
      const Eigen::Vector3d shift_mm = position_mm_ * Eigen::Vector3d(error_[3], error_[4], error_[5]);
      return {Eigen::Matrix3d(rotation_exp(turn) * pose.rotation()), Eigen::Vector3d(pose.translation() + shift_mm)};
    }

   private:
    double position_mm_, angle_rad_, lasting_s_;
    bool started_ = false;
    std::array<double, 6> error_{};
    std::normal_distribution<double> normal_;
  };

  [[nodiscard]] Transform<Camera, Marker> view(double t) const {
    std::array<double, 6> v{};
    for (std::size_t k = 0; k < 6; ++k) {
      for (const Wave& w : waves_.at(k)) v.at(k) += 0.5 * w.size * std::sin(6.283 * w.hz * t + w.phase);
    }
    const Eigen::Matrix3d r =
        rotation_exp(Eigen::Vector3d(0.5 * v[0], 0.5 * v[1], 0)) * rotation_exp(Eigen::Vector3d(0, 0, 0.9 * v[2]));
    return {r, Eigen::Vector3d(20 * v[3], 20 * v[4], 110 + 25 * v[5]) - r * Eigen::Vector3d(30, 20, 0)};
  }

  std::mt19937 rng_;
  std::uniform_real_distribution<double> unit_{0, 1};
  std::array<std::array<Wave, 3>, 6> waves_;
};

}  // namespace birdseye::testing
