#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "hw-sim/phantom/mesh.hpp"

namespace birdseye::hw_sim {

/// How the tissue in a box of the patient lies deformed. The map is inverse: what is at a static point x came from
/// x + u(x), where u is a tensor-product Bezier patch over the box, u(x) = sum_ijk B_i(x) B_j(y) B_k(z) d_ijk, with
/// Bernstein polynomials over [0, 1] along each axis. The control points on the box's surface hold still; the inner
/// ones, `inner` an axis, carry d_ijk. Outside the box nothing moves.
class TissueMap {
 public:
  static constexpr int kMostInner = 7;
  static constexpr double kLeastDeterminant = 0.3;  ///< of the map, below which a draw is thrown away

  TissueMap(const Eigen::Vector3d& low_mm, const Eigen::Vector3d& high_mm, const std::array<int, 3>& inner);

  /// Draws displacements of all inner control points from the seed, scaled so that of the given points of the organ at
  /// rest the one that moves most moves by amplitude_mm. Refused where every draw would fold.
  static Result<TissueMap> random(const TissueMap& still, double amplitude_mm,
                                  std::span<const Eigen::Vector3f> organ_at_rest_mm, std::uint64_t seed);

  [[nodiscard]] Eigen::Vector3d displacement_mm(const Eigen::Vector3d& deformed_mm) const;
  [[nodiscard]] Eigen::Vector3d rest_of(const Eigen::Vector3d& deformed_mm) const;
  /// The inverse of rest_of, to 1e-9 mm, by Newton's method.
  [[nodiscard]] Eigen::Vector3d deformed_of(const Eigen::Vector3d& rest_mm) const;
  /// d rest / d deformed.
  [[nodiscard]] Eigen::Matrix3d jacobian(const Eigen::Vector3d& deformed_mm) const;
  /// The least determinant of the Jacobian over a lattice of 33 points an axis.
  [[nodiscard]] double least_determinant() const;

  [[nodiscard]] const Eigen::Vector3d& low_mm() const { return low_mm_; }
  [[nodiscard]] const Eigen::Vector3d& high_mm() const { return high_mm_; }
  [[nodiscard]] const std::array<int, 3>& inner() const { return inner_; }
  /// Displacements of the inner control points, x fastest.
  [[nodiscard]] const std::vector<Eigen::Vector3d>& control_mm() const { return control_mm_; }

 private:
  [[nodiscard]] bool holds(const Eigen::Vector3d& point_mm) const;

  Eigen::Vector3d low_mm_, high_mm_;
  std::array<int, 3> inner_;
  std::vector<Eigen::Vector3d> control_mm_;
};

Mesh deformed(const Mesh& rest, const TissueMap& map);

}  // namespace birdseye::hw_sim
