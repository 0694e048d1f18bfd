#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/deform/patch_octree.hpp"

namespace birdseye::host {

inline constexpr int kMostDegree = 16;

/// B_0^n(t) to B_n^n(t) of degree n, 0 beyond, by the recurrence that raises the degree: stable, and it sums to one.
std::array<double, kMostDegree + 1> bernstein(int degree, double t);

/// A tensor-product Bezier patch of displacements over the unit cube (the paper's section 5.3): few control points move
/// the whole organ, smoothly. u(x) = sum_ijk B_i^l(x) B_j^m(y) B_k^n(z) d_ijk, with Bernstein polynomials of any degree
/// l, m, n of 1 to 16 along each axis. Control points on the cube's surface hold still, so that the surface does too.
class BezierPatch {
 public:
  /// degree: along x, y, z.
  static Result<BezierPatch> create(const std::array<int, 3>& degree);

  /// Control points that may move: the inner ones.
  [[nodiscard]] std::size_t free_points() const;
  /// Displacements of the inner control points, x fastest, units of the cube.
  void set_displacements(const std::vector<Eigen::Vector3d>& displacements);
  [[nodiscard]] Eigen::Vector3d displacement(const Eigen::Vector3d& point) const;
  /// Sets the octree's free vertices to the patch's displacements.
  void drive(PatchOctree& tree) const;

 private:
  std::array<int, 3> degree_{};
  std::vector<Eigen::Vector3d> control_;  ///< all (l + 1)(m + 1)(n + 1), x fastest
};

}  // namespace birdseye::host
