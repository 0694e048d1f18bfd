// Solids of revolution drawn into a CT: each voxel holds the share that the blurred solid fills.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "host/volume/volume.hpp"

namespace birdseye::testing {

/// A closed outline, from the axis outwards: distance from the axis and height along it, mm.
using Outline = std::vector<Eigen::Vector2d>;

/// How far a point lies outside of an outline, inside: negative.
inline double outside_mm(const Outline& outline, const Eigen::Vector2d& p) {
  double nearest = 1e9;
  bool inside = false;
  for (std::size_t n = 0; n < outline.size(); ++n) {
    const Eigen::Vector2d& a = outline[n];
    const Eigen::Vector2d& b = outline[(n + 1) % outline.size()];
    // An edge on the axis is no surface.
    if (a.x() > 0 || b.x() > 0) {
      const double along = std::clamp((p - a).dot(b - a) / std::max((b - a).squaredNorm(), 1e-12), 0.0, 1.0);
      nearest = std::min(nearest, (p - a - along * (b - a)).norm());
    }
    if ((a.y() > p.y()) != (b.y() > p.y()) && p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x()))
      inside = !inside;
  }
  return inside ? -nearest : nearest;
}

/// A patient's piece of CT to draw in.
class DrawnCt {
 public:
  DrawnCt(const Eigen::Vector3d& size_mm, const Eigen::Vector3d& spacing_mm, const Eigen::Matrix3d& axes, double hu) {
    ct.spacing_mm = spacing_mm;
    for (int axis = 0; axis < 3; ++axis)
      ct.size[static_cast<std::size_t>(axis)] = static_cast<int>(std::lround(size_mm[axis] / spacing_mm[axis]));
    ct.patient_from_voxel.linear() = axes * spacing_mm.asDiagonal();
    ct.patient_from_voxel.translation() = -axes * (0.5 * size_mm);
    values_.assign(host::grid_count(ct.size), hu);
  }

  /// Adds rise_hu times the share of each voxel that the blurred solid fills. What is drawn one over another adds up:
  /// a cavity is its wall's rise taken back.
  template <typename Outside>
  void add(const Eigen::Vector3d& centre, double reach_mm, double blur_mm, double rise_hu, const Outside& outside) {
    const Eigen::Vector3d middle = ct.patient_from_voxel.inverse() * centre;
    const Eigen::Array3d reach = (reach_mm + 3 * blur_mm) / ct.spacing_mm.array() + 1;
    const Eigen::Array3d last = Eigen::Array3d(ct.size[0], ct.size[1], ct.size[2]) - 1;
    const Eigen::Array3i low = (middle.array() - reach).max(0).min(last).cast<int>();
    const Eigen::Array3i high = (middle.array() + reach).max(0).min(last).cast<int>();
    for (int k = low.z(); k <= high.z(); ++k) {
      for (int j = low.y(); j <= high.y(); ++j) {
        for (int i = low.x(); i <= high.x(); ++i)
          values_[ct.index(i, j, k)] += rise_hu * share({i, j, k}, blur_mm, outside);
      }
    }
  }
  void add_turned(const Outline& outline, const Eigen::Vector3d& centre, const Eigen::Vector3d& axis, double blur_mm,
                  double rise_hu) {
    double reach = 0;
    for (const Eigen::Vector2d& p : outline) reach = std::max(reach, p.norm());
    add(centre, reach, blur_mm, rise_hu, [&](const Eigen::Vector3d& p) {
      const double along = (p - centre).dot(axis);
      return outside_mm(outline, {(p - centre - along * axis).norm(), along});
    });
  }
  void finish(double noise_hu, std::mt19937& rng) {
    std::normal_distribution<double> normal(0, noise_hu);
    ct.hu.resize(values_.size());
    for (std::size_t n = 0; n < values_.size(); ++n)
      ct.hu[n] = static_cast<std::int16_t>(std::lround(std::clamp(values_[n] + normal(rng), -1024.0, 3071.0)));
  }

  host::Volume ct;

 private:
  template <typename Outside>
  double share(const Eigen::Vector3i& voxel, double blur_mm, const Outside& outside) const {
    const double here = outside(ct.patient_from_voxel * voxel.cast<double>());
    if (std::abs(here) > 0.5 * ct.spacing_mm.norm() + 4 * blur_mm) return here < 0 ? 1 : 0;
    Eigen::Array3i parts;
    for (int axis = 0; axis < 3; ++axis)
      parts[axis] = std::max(2, static_cast<int>(std::ceil(ct.spacing_mm[axis] / 0.3)));
    double sum = 0;
    for (int k = 0; k < parts.z(); ++k) {
      for (int j = 0; j < parts.y(); ++j) {
        for (int i = 0; i < parts.x(); ++i) {
          const Eigen::Array3d offset = (Eigen::Array3d(i, j, k) + 0.5) / parts.cast<double>() - 0.5;
          const Eigen::Vector3d p = ct.patient_from_voxel * (voxel.cast<double>() + offset.matrix());
          sum += 0.5 * std::erfc(outside(p) / (blur_mm * std::sqrt(2.0)));
        }
      }
    }
    return sum / parts.prod();
  }

  std::vector<double> values_;
};

}  // namespace birdseye::testing
