#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/case/tissue_map.hpp"

namespace birdseye::hw_sim {

/// A map by a tensor-product Bezier patch over its box: what is at x now came from x + u(x),
/// u(x) = sum_ijk B_i(x) B_j(y) B_k(z) d_ijk, with Bernstein polynomials over [0, 1] along each axis. The control
/// points on the box's surface hold still; the inner ones, `inner` an axis, carry d_ijk. Outside the box nothing moves.
class BezierMap final : public TissueMap {
 public:
  static constexpr int kMostInner = 7;

  BezierMap(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm, const std::array<int, 3>& inner);

  /// Draws displacements of all inner control points from the seed, scaled so that of the given points of the organ at
  /// rest the one that moves most moves by amplitude_mm. Refused where every draw would fold.
  static Result<BezierMap> random(const BezierMap& still, double amplitude_mm,
                                  std::span<const Eigen::Vector3f> organ_at_rest_mm, std::uint64_t seed);

  [[nodiscard]] Eigen::Vector3d displacement_mm(const Eigen::Vector3d& deformed_mm) const override;
  /// By Newton's method.
  [[nodiscard]] Eigen::Vector3d deformed_of(const Eigen::Vector3d& rest_mm) const override;
  [[nodiscard]] Eigen::Matrix3d jacobian(const Eigen::Vector3d& deformed_mm) const override;
  [[nodiscard]] double least_determinant() const override;

  [[nodiscard]] const std::array<int, 3>& inner() const { return inner_; }
  /// Displacements of the inner control points, x fastest.
  [[nodiscard]] const std::vector<Eigen::Vector3d>& control_mm() const { return control_mm_; }

 private:
  [[nodiscard]] bool holds(const Eigen::Vector3d& point_mm) const;

  std::array<int, 3> inner_;
  std::vector<Eigen::Vector3d> control_mm_;
};

}  // namespace birdseye::hw_sim
