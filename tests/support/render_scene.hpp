#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "host/deform/displacement_field.hpp"
#include "host/render/reference/reference_renderer.hpp"
#include "host/render/scene/scene.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"
#include "tests/support/lens.hpp"

namespace birdseye::testing {

using host::DisplacementField;
using host::PatchOctree;
using host::TransferFunction;
using host::Volume;

/// A blob with a dense core and a rod, smooth, on an oblique anisotropic grid.
inline Volume scene() {
  Volume v;
  v.size = {40, 36, 30};
  v.spacing_mm = {1.4, 1.6, 2.1};
  v.patient_from_voxel.linear() = rotation_exp(Eigen::Vector3d(0.3, -0.4, 0.2)) * v.spacing_mm.asDiagonal();
  v.patient_from_voxel.translation() = Eigen::Vector3d(-30, -20, 60);
  for (int k = 0; k < 30; ++k) {
    for (int j = 0; j < 36; ++j) {
      for (int i = 0; i < 40; ++i) {
        const double blob =
            std::exp(-(std::pow((i - 18) / 9.0, 2) + std::pow((j - 17) / 8.0, 2) + std::pow((k - 15) / 7.0, 2)));
        const double rod = std::exp(-(std::pow((i - 30) / 3.0, 2) + std::pow((j - 12) / 3.0, 2)));
        v.hu.push_back(static_cast<std::int16_t>(std::lround(-900 + 1300 * blob + 1100 * rod)));
      }
    }
  }
  return v;
}

inline TransferFunction soft() {
  return TransferFunction(
      {{-400, {0.5, 0.1, 0.1}, 0}, {0, {0.9, 0.4, 0.2}, 0.05}, {200, {0.9, 0.8, 0.6}, 0.2}, {600, {1, 1, 0.9}, 0.4}});
}

inline CameraModel lens() {
  return wide_lens(128, 96);
}

/// A camera that looks at the scene's middle from 110 mm.
inline Transform<Camera, Patient> pose(const Volume& v) {
  const Eigen::Vector3d middle = v.patient_from_voxel * Eigen::Vector3d(20, 18, 15);
  const Eigen::Matrix3d r = rotation_exp(Eigen::Vector3d(0.4, 0.7, -0.2));
  return {r, Eigen::Vector3d(0, 0, 110) - r * middle};
}

/// Patches over the whole volume, their vertices moved at random, in part by more than a brick.
inline DisplacementField bent(const Volume& volume, int level, double amount, unsigned seed) {
  PatchOctree tree = *PatchOctree::uniform(level);
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> uniform(-amount, amount);
  std::vector<Eigen::Vector3d> moves;
  for (std::size_t i = 0; i < tree.free_vertices(); ++i) moves.emplace_back(uniform(rng), uniform(rng), uniform(rng));
  tree.set_displacements(moves);
  const Eigen::Vector3d last(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  return field_of(tree, volume.patient_from_voxel * Eigen::Scaling(last));
}

/// Of a picture from the reference, in parts of 255.
struct Difference {
  double mean = 0, worst = 0;
};
inline Difference difference(const host::ImageRgba& picture, const std::vector<double>& reference) {
  Difference d;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    const double error = std::abs(picture.rgba[i] - 255 * reference[i]);
    d.mean += error / static_cast<double>(reference.size());
    d.worst = std::max(d.worst, error);
  }
  return d;
}

}  // namespace birdseye::testing
