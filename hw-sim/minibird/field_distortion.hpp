#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "hw-sim/minibird/record_encoder.hpp"

namespace birdseye::hw_sim {

/// What metal near the transmitter does to a pose: a smooth displacement of the position,
///
///   d(p) = peak * sum_k g_k n_k exp(-|p - c_k|^2 / (2 s_k^2)) / m,   k = 1..3
///
/// with centres c_k in the working volume (x 100..700, y and z -300..300 mm), widths s_k of 120..240 mm, weights g_k of
/// 0.5..1 and unit directions n_k drawn from the seed, and m such that |d| is `peak` where it is largest on a grid of
/// 25 mm over that volume. The orientation turns with the field: by the rotation vector curl(d) / 2, rad.
class FieldDistortion {
 public:
  FieldDistortion(double peak_mm, std::uint64_t seed);

  [[nodiscard]] Eigen::Vector3d displacement_mm(const Eigen::Vector3d& position_mm) const;
  [[nodiscard]] Eigen::Vector3d rotation_rad(const Eigen::Vector3d& position_mm) const;
  /// The pose as measured. strength: 1 for the whole distortion.
  [[nodiscard]] BirdPose apply(const BirdPose& pose, double strength = 1) const;

 private:
  struct Bump {
    Eigen::Vector3d centre_mm, amplitude_mm;
    double width_mm;
  };
  std::array<Bump, 3> bumps_;
};

}  // namespace birdseye::hw_sim
