#include "host/deform/bezier_patch.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace birdseye::host {

std::array<double, kMostDegree + 1> bernstein(int degree, double t) {
  std::array<double, kMostDegree + 1> b{};
  b[0] = 1;
  for (int n = 1; n <= degree; ++n) {
    for (int i = n; i > 0; --i) {
      const auto at = static_cast<std::size_t>(i);
      b[at] = (1 - t) * b[at] + t * b[at - 1];
    }
    b[0] *= 1 - t;
  }
  return b;
}

Result<BezierPatch> BezierPatch::create(const std::array<int, 3>& degree) {
  for (const int d : degree) {
    if (d < 1 || d > kMostDegree) {
      return Error{Errc::bad_value, fmt::format("a Bezier patch of degree {}: degrees are 1 to {}", d, kMostDegree)};
    }
  }
  BezierPatch patch;
  patch.degree_ = degree;
  std::size_t points = 1;
  for (const int d : degree) points *= static_cast<std::size_t>(d) + 1;
  patch.control_.assign(points, Eigen::Vector3d::Zero());
  return patch;
}

std::size_t BezierPatch::free_points() const {
  std::size_t points = 1;
  for (const int d : degree_) points *= static_cast<std::size_t>(d) - 1;
  return points;
}

void BezierPatch::set_displacements(const std::vector<Eigen::Vector3d>& displacements) {
  std::size_t next = 0;
  std::size_t at = 0;
  for (int k = 0; k <= degree_[2]; ++k) {
    for (int j = 0; j <= degree_[1]; ++j) {
      for (int i = 0; i <= degree_[0]; ++i, ++at) {
        const bool inner = i > 0 && j > 0 && k > 0 && i < degree_[0] && j < degree_[1] && k < degree_[2];
        if (inner && next < displacements.size()) control_[at] = displacements[next++];
      }
    }
  }
}

Eigen::Vector3d BezierPatch::displacement(const Eigen::Vector3d& point) const {
  if (point.minCoeff() < 0 || point.maxCoeff() > 1) return Eigen::Vector3d::Zero();
  const auto bx = bernstein(degree_[0], point.x());
  const auto by = bernstein(degree_[1], point.y());
  const auto bz = bernstein(degree_[2], point.z());
  Eigen::Vector3d u = Eigen::Vector3d::Zero();
  std::size_t at = 0;
  for (std::size_t k = 0; k <= static_cast<std::size_t>(degree_[2]); ++k) {
    for (std::size_t j = 0; j <= static_cast<std::size_t>(degree_[1]); ++j) {
      for (std::size_t i = 0; i <= static_cast<std::size_t>(degree_[0]); ++i, ++at)
        u += bx[i] * by[j] * bz[k] * control_[at];
    }
  }
  return u;
}

void BezierPatch::drive(PatchOctree& tree) const {
  std::vector<Eigen::Vector3d> displacements;
  displacements.reserve(tree.free_vertices());
  for (std::size_t i = 0; i < tree.free_vertices(); ++i) displacements.push_back(displacement(tree.vertex(i)));
  tree.set_displacements(displacements);
}

}  // namespace birdseye::host
