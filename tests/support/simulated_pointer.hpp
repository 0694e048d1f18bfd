#pragma once

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "calibration/base/units.hpp"
#include "calibration/points/pivot.hpp"

namespace birdseye::calibration {

/// A pointer tilted about a divot, to all sides by up to tilt_deg, and turned about its shaft by up to spin_deg.
struct SimulatedPointer {
  std::mt19937_64 random{3};
  Eigen::Vector3d tip_mm{12, -3, 180}, pivot_mm{350, -40, 120};
  double tilt_deg = 30, sideways_deg = 30, spin_deg = 0;
  double position_noise_mm = 0, angle_noise_deg = 0;  ///< rms of one coordinate, and of one angle

  Eigen::Vector3d noise(double deviation) {
    std::normal_distribution<double> normal;
    return deviation * Eigen::Vector3d(normal(random), normal(random), normal(random));
  }
  Transform<Tracker, Sensor> pose() {
    std::uniform_real_distribution<double> unit(-1, 1);
    const auto turn = [&](double most_deg, const Eigen::Vector3d& axis) {
      return Eigen::AngleAxisd(most_deg * kRadPerDeg * unit(random), axis).toRotationMatrix();
    };
    const Eigen::Matrix3d rotation = turn(tilt_deg, Eigen::Vector3d::UnitX()) *
                                     turn(sideways_deg, Eigen::Vector3d::UnitY()) * turn(spin_deg, tip_mm.normalized());
    const Eigen::Matrix3d seen = rotation * rotation_exp(noise(angle_noise_deg * kRadPerDeg));
    return {seen, Eigen::Vector3d(pivot_mm - rotation * tip_mm + noise(position_noise_mm))};
  }
  std::vector<PivotPose> poses(int count, std::size_t divot = 0) {
    std::vector<PivotPose> all;
    for (int i = 0; i < count; ++i) all.push_back({pose(), divot, 0.1 * i});
    return all;
  }
};

}  // namespace birdseye::calibration
