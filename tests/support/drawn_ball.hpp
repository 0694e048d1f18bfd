#pragma once

#include <Eigen/Core>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "host/registration/geometry/pinhole_view.hpp"

namespace birdseye::testing {

/// A ball with a solid pattern before a wall of another colour, drawn by the formula of where a ray meets a ball: no
/// renderer of ours. What it is a picture of is known exactly.
class DrawnBall {
 public:
  DrawnBall(const Eigen::Vector3d& centre_mm, double radius_mm) : centre_mm_(centre_mm), radius_mm_(radius_mm) {
    constexpr int kWaves = 40;
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> length_mm(3, 9), phase(0, 2 * std::numbers::pi);
    for (int i = 0; i < kWaves; ++i) {
      const Eigen::Vector3d along = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
      waves_.push_back({2 * std::numbers::pi / length_mm(random) * along, phase(random)});
    }
  }

  /// By a pinhole camera of 768x576 that looks from eye_mm at target_mm.
  [[nodiscard]] host::PinholeView seen_from(const Eigen::Vector3d& eye_mm, const Eigen::Vector3d& target_mm) const {
    host::VideoView view;
    CameraModel& camera = view.camera;
    camera.width_px = 768;
    camera.height_px = 576;
    camera.fx_px = camera.fy_px = 700;
    camera.cx_px = 383.5;
    camera.cy_px = 287.5;
    const Eigen::Vector3d z = (target_mm - eye_mm).normalized(), x = Eigen::Vector3d::UnitY().cross(z).normalized();
    Eigen::Matrix3d rotation;
    rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    view.camera_from_patient = Transform<Camera, Patient>(rotation, Eigen::Vector3d(-rotation * eye_mm));
    std::vector<std::uint8_t> rgb;
    for (int row = 0; row < camera.height_px; ++row) {
      for (int column = 0; column < camera.width_px; ++column) {
        const Eigen::Vector3d ray((column - camera.cx_px) / camera.fx_px, (row - camera.cy_px) / camera.fy_px, 1);
        const Eigen::Vector3d colour = colour_along(eye_mm, rotation.transpose() * ray.normalized());
        for (const double channel : colour) rgb.push_back(static_cast<std::uint8_t>(std::lround(channel)));
      }
    }
    view.mask.assign(rgb.size() / 3, 255);
    return host::pinhole_view(view, {rgb, camera.width_px, camera.height_px});
  }

 private:
  struct Wave {
    Eigen::Vector3d per_mm;
    double phase;
  };

  [[nodiscard]] Eigen::Vector3d colour_along(const Eigen::Vector3d& eye_mm, const Eigen::Vector3d& ray) const {
    const Eigen::Vector3d from_centre = eye_mm - centre_mm_;
    const double b = ray.dot(from_centre);
    const double inner = b * b - from_centre.squaredNorm() + radius_mm_ * radius_mm_;
    if (inner < 0) return {150, 140, 110};
    const Eigen::Vector3d on_ball = from_centre + (-b - std::sqrt(inner)) * ray;
    double pattern = 0;
    for (const Wave& wave : waves_) pattern += std::sin(wave.per_mm.dot(on_ball) + wave.phase);
    pattern /= std::sqrt(0.5 * static_cast<double>(waves_.size()));
    const double shade = (0.35 + 0.65 * -on_ball.dot(ray) / radius_mm_) * std::max(0.2, 1 + 0.2 * pattern);
    return (shade * Eigen::Vector3d(130, 60, 45)).cwiseMin(220);
  }

  Eigen::Vector3d centre_mm_;
  double radius_mm_;
  std::vector<Wave> waves_;
};

}  // namespace birdseye::testing
