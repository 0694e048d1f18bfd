#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// A deformation of the unit cube by an octree of patches (the paper's section 3). The map is inverse: the picture at a
/// static point x shows what the undeformed volume has at x + u(x), with u trilinear in each patch between the
/// displacements of its eight corners. The cube's surface does not move.
///
/// Patches are of levels 0 (the cube) to kDeepest (32 an axis), in any mix. A corner of a small patch that lies in a
/// face or on an edge of a larger patch is constrained to the larger patch's value there, so that u is continuous
/// everywhere: no crack opens where levels meet. Free vertices are those that are neither on the cube's surface nor
/// constrained: 1, 27, 343, 3375 and 29791 of them where all patches are of level 1 to 5.
class PatchOctree {
 public:
  static constexpr int kDeepest = 5;
  static constexpr int kLattice = 1 << kDeepest;  ///< patches of the deepest level along an axis

  /// All patches of one level, 0 to kDeepest.
  static Result<PatchOctree> uniform(int level);
  /// Divides each patch for which wanted(low, high, level) is true, down to the level deepest; low and high are the
  /// patch's corners in the unit cube.
  static Result<PatchOctree> adaptive(
      const std::function<bool(const Eigen::Vector3d& low, const Eigen::Vector3d& high, int level)>& wanted,
      int deepest);

  struct Patch {
    std::array<int, 3> low{};  ///< on the lattice of kLattice an axis
    int level = 0;
    [[nodiscard]] int size() const { return kLattice >> level; }
  };
  [[nodiscard]] const std::vector<Patch>& patches() const { return patches_; }

  [[nodiscard]] std::size_t free_vertices() const { return free_.size(); }
  /// Where free vertex i is at rest, in the unit cube.
  [[nodiscard]] Eigen::Vector3d vertex(std::size_t i) const;
  /// Moves the free vertices: displacements, in units of the cube, one per free vertex.
  void set_displacements(const std::vector<Eigen::Vector3d>& displacements);
  [[nodiscard]] std::vector<Eigen::Vector3d> displacements() const;

  /// u(x), units of the cube; zero outside of it.
  [[nodiscard]] Eigen::Vector3d displacement(const Eigen::Vector3d& point) const;
  /// d(x + u(x)) / dx within the patch of the point.
  [[nodiscard]] Eigen::Matrix3d jacobian(const Eigen::Vector3d& point) const;
  /// The x for which x + u(x) is the given point, to within tolerance; empty where the map folds there.
  [[nodiscard]] std::optional<Eigen::Vector3d> inverse(const Eigen::Vector3d& point, double tolerance) const;

 private:
  PatchOctree() = default;
  void divide(const std::function<bool(const Eigen::Vector3d&, const Eigen::Vector3d&, int)>& wanted, Patch patch,
              int deepest);
  /// The patch that holds a point of the unit cube. A point on a face between two patches belongs to the one with the
  /// larger coordinates.
  [[nodiscard]] std::size_t patch_at(const Eigen::Vector3d& point) const;
  void classify_vertices();
  void apply_constraints();
  [[nodiscard]] static std::size_t lattice_index(int i, int j, int k);
  [[nodiscard]] std::array<Eigen::Vector3d, 8> corners(const Patch& patch) const;

  struct Constraint {
    std::array<int, 3> vertex;
    std::size_t patch;  ///< the larger patch whose face or edge it lies in
  };
  std::vector<Patch> patches_;
  std::vector<std::uint16_t> patch_of_cell_;   ///< of each cell of the deepest lattice
  std::vector<Eigen::Vector3d> displacement_;  ///< of each vertex of the deepest lattice
  std::vector<std::array<int, 3>> free_;
  std::vector<Constraint> constraints_;  ///< largest patches first
};

}  // namespace birdseye::host
