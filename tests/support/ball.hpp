#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "host/volume/signed_distance.hpp"

namespace birdseye::testing {

/// A ball about the origin, in a box with 30 mm about it; its distance is exact at the grid's points.
inline host::SignedDistance ball(double radius_mm) {
  constexpr double kSpacing_mm = 2, kMargin_mm = 30;
  const double half_mm = radius_mm + kMargin_mm;
  const int along = static_cast<int>(2 * half_mm / kSpacing_mm) + 1;
  const std::array<int, 3> points{along, along, along};
  Eigen::Affine3d patient_from_box = Eigen::Affine3d::Identity();
  patient_from_box.translation().setConstant(-half_mm);
  std::vector<float> distances_mm;
  for (int k = 0; k < along; ++k) {
    for (int j = 0; j < along; ++j) {
      for (int i = 0; i < along; ++i) {
        const Eigen::Vector3d place_mm = patient_from_box * (kSpacing_mm * Eigen::Vector3d(i, j, k));
        distances_mm.push_back(static_cast<float>(place_mm.norm() - radius_mm));
      }
    }
  }
  return {points, kSpacing_mm, patient_from_box, distances_mm};
}

}  // namespace birdseye::testing
