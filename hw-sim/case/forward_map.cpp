#include "hw-sim/case/forward_map.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace birdseye::hw_sim {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d ForwardMap::deformed_of(const Vector3d& rest_mm) const {
  return rest_mm + move_mm_(rest_mm);
}

Matrix3d ForwardMap::stretch(const Vector3d& rest_mm) const {
  constexpr double kStep_mm = 1e-4;  // rounding and curvature each make less than 1e-8 of it
  Matrix3d out;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = kStep_mm * Vector3d::Unit(axis);
    out.col(axis) = (deformed_of(rest_mm + step) - deformed_of(rest_mm - step)) / (2 * kStep_mm);
  }
  return out;
}

Vector3d ForwardMap::displacement_mm(const Vector3d& deformed_mm) const {
  constexpr double kTolerance_mm = 1e-10;
  constexpr int kSteps = 40, kHalvings = 10;
  Vector3d rest = deformed_mm - move_mm_(deformed_mm);
  Vector3d residual = deformed_of(rest) - deformed_mm;
  for (int step = 0; step < kSteps && residual.norm() > kTolerance_mm; ++step) {
    const Vector3d newton = stretch(rest).partialPivLu().solve(residual);
    double share = 1;
    for (int halving = 0; halving < kHalvings; ++halving, share *= 0.5) {
      const Vector3d next = rest - share * newton;
      const Vector3d left = deformed_of(next) - deformed_mm;
      if (left.norm() >= residual.norm()) continue;
      rest = next;
      residual = left;
      break;
    }
  }
  return rest - deformed_mm;
}

Matrix3d ForwardMap::jacobian(const Vector3d& deformed_mm) const {
  return stretch(rest_of(deformed_mm)).inverse();
}

double ForwardMap::least_determinant() const {
  constexpr int kPoints = 49;
  const Vector3d margin = 0.1 * (high_mm() - low_mm());
  return least_over_lattice(low_mm() - margin, high_mm() + margin, kPoints, [this](const Vector3d& rest) {
    const double growth = stretch(rest).determinant();
    return growth > 0 ? std::min(growth, 1 / growth) : growth;
  });
}

}  // namespace birdseye::hw_sim
