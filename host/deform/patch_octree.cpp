#include "host/deform/patch_octree.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

namespace birdseye::host {

namespace {

using Eigen::Vector3d;
constexpr int kSide = PatchOctree::kLattice + 1;

std::size_t cell_index(int i, int j, int k) {
  constexpr std::size_t kCells = PatchOctree::kLattice;
  return (static_cast<std::size_t>(k) * kCells + static_cast<std::size_t>(j)) * kCells + static_cast<std::size_t>(i);
}

/// Trilinear weights' derivatives and values share this: corner c of a cell, at local coordinates t in [0, 1].
double weight(int corner, const Vector3d& t) {
  double w = 1;
  for (int axis = 0; axis < 3; ++axis) w *= (corner >> axis & 1) != 0 ? t[axis] : 1 - t[axis];
  return w;
}

Eigen::Matrix3d trilinear_jacobian(const std::array<Vector3d, 8>& corner, const Vector3d& t) {
  Eigen::Matrix3d j = Eigen::Matrix3d::Zero();
  for (int c = 0; c < 8; ++c) {
    for (int axis = 0; axis < 3; ++axis) {
      double w = (c >> axis & 1) != 0 ? 1 : -1;
      for (int other = 0; other < 3; ++other) {
        if (other != axis) w *= (c >> other & 1) != 0 ? t[other] : 1 - t[other];
      }
      j.col(axis) += w * corner[static_cast<std::size_t>(c)];
    }
  }
  return j;
}

}  // namespace

std::size_t PatchOctree::lattice_index(int i, int j, int k) {
  return (static_cast<std::size_t>(k) * kSide + static_cast<std::size_t>(j)) * kSide + static_cast<std::size_t>(i);
}

Result<PatchOctree> PatchOctree::uniform(int level) {
  return adaptive([](const Vector3d&, const Vector3d&, int) { return true; }, level);
}

Result<PatchOctree> PatchOctree::adaptive(const std::function<bool(const Vector3d&, const Vector3d&, int)>& wanted,
                                          int deepest) {
  if (deepest < 0 || deepest > kDeepest) {
    return Error{Errc::bad_value, fmt::format("level {}: levels are 0 to {}", deepest, kDeepest)};
  }
  PatchOctree tree;
  tree.divide(wanted, Patch{}, deepest);
  tree.patch_of_cell_.resize(static_cast<std::size_t>(kLattice) * kLattice * kLattice);
  for (std::size_t p = 0; p < tree.patches_.size(); ++p) {
    const Patch& patch = tree.patches_[p];
    const int n = patch.size();
    for (int cell = 0; cell < n * n * n; ++cell) {
      const int i = patch.low[0] + cell % n;
      const int j = patch.low[1] + cell / n % n;
      const int k = patch.low[2] + cell / (n * n);
      tree.patch_of_cell_[cell_index(i, j, k)] = static_cast<std::uint16_t>(p);
    }
  }
  tree.displacement_.assign(static_cast<std::size_t>(kSide) * kSide * kSide, Vector3d::Zero());
  tree.classify_vertices();
  return tree;
}

void PatchOctree::divide(const std::function<bool(const Vector3d&, const Vector3d&, int)>& wanted, Patch patch,
                         int deepest) {
  const Vector3d low = Vector3d(patch.low[0], patch.low[1], patch.low[2]) / kLattice;
  const Vector3d high = low + Vector3d::Constant(static_cast<double>(patch.size()) / kLattice);
  if (patch.level == deepest || !wanted(low, high, patch.level)) {
    patches_.push_back(patch);
    return;
  }
  const int half = patch.size() / 2;
  for (int child = 0; child < 8; ++child) {
    Patch part;
    part.level = patch.level + 1;
    for (int axis = 0; axis < 3; ++axis) {
      const auto a = static_cast<std::size_t>(axis);
      part.low[a] = patch.low[a] + ((child >> axis & 1) != 0 ? half : 0);
    }
    divide(wanted, part, deepest);
  }
}

void PatchOctree::classify_vertices() {
  std::vector<std::uint8_t> seen(displacement_.size(), 0);
  for (const Patch& patch : patches_) {
    for (int c = 0; c < 8; ++c) {
      std::array<int, 3> v{};
      bool surface = false;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        v[axis] = patch.low[axis] + ((c >> axis & 1) != 0 ? patch.size() : 0);
        surface = surface || v[axis] == 0 || v[axis] == kLattice;
      }
      std::uint8_t& mark = seen[lattice_index(v[0], v[1], v[2])];
      if (mark != 0 || surface) continue;
      mark = 1;
      // Of the patches that touch the vertex, the largest that does not have it for a corner constrains it.
      std::optional<std::size_t> larger;
      for (int side = 0; side < 8; ++side) {
        const int i = v[0] - (side & 1);
        const int j = v[1] - (side >> 1 & 1);
        const int k = v[2] - (side >> 2);
        const std::size_t p = patch_of_cell_[cell_index(i, j, k)];
        bool corner = true;
        for (std::size_t axis = 0; axis < 3; ++axis)
          corner = corner && (v[axis] - patches_[p].low[axis]) % patches_[p].size() == 0;
        if (!corner && (!larger || patches_[p].level < patches_[*larger].level)) larger = p;
      }
      larger ? constraints_.push_back({v, *larger}) : free_.push_back(v);
    }
  }
  std::stable_sort(constraints_.begin(), constraints_.end(), [this](const Constraint& a, const Constraint& b) {
    return patches_[a.patch].level < patches_[b.patch].level;
  });
}

std::array<Vector3d, 8> PatchOctree::corners(const Patch& patch) const {
  std::array<Vector3d, 8> out;
  const int n = patch.size();
  for (int c = 0; c < 8; ++c) {
    out[static_cast<std::size_t>(c)] = displacement_[lattice_index(
        patch.low[0] + (c & 1) * n, patch.low[1] + (c >> 1 & 1) * n, patch.low[2] + (c >> 2) * n)];
  }
  return out;
}

void PatchOctree::apply_constraints() {
  // A larger patch's corners are settled before the vertices that hang on it.
  for (const Constraint& constraint : constraints_) {
    const Patch& patch = patches_[constraint.patch];
    const auto& v = constraint.vertex;
    const Vector3d t = Vector3d(v[0] - patch.low[0], v[1] - patch.low[1], v[2] - patch.low[2]) / patch.size();
    const auto corner = corners(patch);
    Vector3d u = Vector3d::Zero();
    for (int c = 0; c < 8; ++c) u += weight(c, t) * corner[static_cast<std::size_t>(c)];
    displacement_[lattice_index(v[0], v[1], v[2])] = u;
  }
}

std::size_t PatchOctree::patch_at(const Vector3d& point) const {
  std::array<int, 3> cell{};
  for (int axis = 0; axis < 3; ++axis) {
    cell[static_cast<std::size_t>(axis)] =
        std::clamp(static_cast<int>(std::floor(point[axis] * kLattice)), 0, kLattice - 1);
  }
  return patch_of_cell_[cell_index(cell[0], cell[1], cell[2])];
}

Vector3d PatchOctree::vertex(std::size_t i) const {
  return Vector3d(free_[i][0], free_[i][1], free_[i][2]) / kLattice;
}

void PatchOctree::set_displacements(const std::vector<Vector3d>& displacements) {
  for (std::size_t i = 0; i < std::min(displacements.size(), free_.size()); ++i) {
    displacement_[lattice_index(free_[i][0], free_[i][1], free_[i][2])] = displacements[i];
  }
  apply_constraints();
}

std::vector<Vector3d> PatchOctree::displacements() const {
  std::vector<Vector3d> out;
  out.reserve(free_.size());
  for (const auto& v : free_) out.push_back(displacement_[lattice_index(v[0], v[1], v[2])]);
  return out;
}

Vector3d PatchOctree::displacement(const Vector3d& point) const {
  if (point.minCoeff() < 0 || point.maxCoeff() > 1) return Vector3d::Zero();
  const Patch& patch = patches_[patch_at(point)];
  const Vector3d t = (point * kLattice - Vector3d(patch.low[0], patch.low[1], patch.low[2])) / patch.size();
  const auto corner = corners(patch);
  Vector3d u = Vector3d::Zero();
  for (int c = 0; c < 8; ++c) u += weight(c, t) * corner[static_cast<std::size_t>(c)];
  return u;
}

Eigen::Matrix3d PatchOctree::jacobian(const Vector3d& point) const {
  if (point.minCoeff() < 0 || point.maxCoeff() > 1) return Eigen::Matrix3d::Identity();
  const Patch& patch = patches_[patch_at(point)];
  const Vector3d t = (point * kLattice - Vector3d(patch.low[0], patch.low[1], patch.low[2])) / patch.size();
  const double per_cube = static_cast<double>(kLattice) / patch.size();
  return Eigen::Matrix3d::Identity() + per_cube * trilinear_jacobian(corners(patch), t);
}

std::optional<Vector3d> PatchOctree::inverse(const Vector3d& point, double tolerance) const {
  if (point.minCoeff() < 0 || point.maxCoeff() > 1) return point;
  // Newton, damped so that each step brings the image nearer: the Jacobian changes from patch to patch.
  constexpr int kMostSteps = 60;
  Vector3d x = point;
  Vector3d miss = x + displacement(x) - point;
  for (int step = 0; step < kMostSteps; ++step) {
    if (miss.norm() <= tolerance) return x;
    const Eigen::Matrix3d j = jacobian(x);
    if (!(j.determinant() > 1e-6)) return std::nullopt;
    const Vector3d move = -(j.inverse() * miss);
    constexpr int kMostHalvings = 13;
    Vector3d next = x;
    Vector3d next_miss = miss;
    int halvings = 0;
    for (; halvings <= kMostHalvings; ++halvings) {
      next = (x + std::ldexp(1.0, -halvings) * move).cwiseMax(0.0).cwiseMin(1.0);
      next_miss = next + displacement(next) - point;
      if (next_miss.norm() < miss.norm()) break;
    }
    if (halvings > kMostHalvings) return std::nullopt;
    x = next;
    miss = next_miss;
  }
  return std::nullopt;
}

}  // namespace birdseye::host
