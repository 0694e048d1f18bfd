#include "host/deform/displacement_field.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace birdseye::host {

Eigen::Vector3d DisplacementField::displacement(const Eigen::Vector3d& point_in_patient_mm) const {
  const Eigen::Vector3d x = patient_from_lattice.inverse() * point_in_patient_mm;
  int base[3];
  double part[3];
  for (int axis = 0; axis < 3; ++axis) {
    const int last = size[static_cast<std::size_t>(axis)] - 1;
    if (x[axis] < 0 || x[axis] > last) return Eigen::Vector3d::Zero();
    base[axis] = std::min(static_cast<int>(x[axis]), std::max(0, last - 1));
    part[axis] = x[axis] - base[axis];
  }
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int c = 0; c < 8; ++c) {
    double w = 1;
    int v[3];
    for (int axis = 0; axis < 3; ++axis) {
      const int bit = c >> axis & 1;
      w *= bit != 0 ? part[axis] : 1 - part[axis];
      v[axis] = std::min(base[axis] + bit, size[static_cast<std::size_t>(axis)] - 1);
    }
    sum += w * at(v[0], v[1], v[2]).cast<double>();
  }
  return sum;
}

DisplacementField field_of(const PatchOctree& tree, const Eigen::Affine3d& patient_from_cube) {
  constexpr int kSide = PatchOctree::kLattice + 1;
  DisplacementField field;
  field.size = {kSide, kSide, kSide};
  field.patient_from_lattice = patient_from_cube * Eigen::Scaling(1.0 / PatchOctree::kLattice);
  field.displacement_mm.reserve(static_cast<std::size_t>(kSide) * kSide * kSide);
  for (int k = 0; k < kSide; ++k) {
    for (int j = 0; j < kSide; ++j) {
      for (int i = 0; i < kSide; ++i) {
        const Eigen::Vector3d x = Eigen::Vector3d(i, j, k) / PatchOctree::kLattice;
        field.displacement_mm.emplace_back((patient_from_cube.linear() * tree.displacement(x)).cast<float>());
      }
    }
  }
  return field;
}

double least_determinant(const DisplacementField& field) {
  const Eigen::Matrix3d lattice_from_patient = field.patient_from_lattice.linear().inverse();
  double least = std::numeric_limits<double>::max();
  for (int k = 0; k + 1 < field.size[2]; ++k) {
    for (int j = 0; j + 1 < field.size[1]; ++j) {
      for (int i = 0; i + 1 < field.size[0]; ++i) {
        for (int c = 0; c < 8; ++c) {
          const int a = i + (c & 1);
          const int b = j + (c >> 1 & 1);
          const int d = k + (c >> 2);
          Eigen::Matrix3d by_lattice;
          by_lattice << (field.at(i + 1, b, d) - field.at(i, b, d)).cast<double>(),
              (field.at(a, j + 1, d) - field.at(a, j, d)).cast<double>(),
              (field.at(a, b, k + 1) - field.at(a, b, k)).cast<double>();
          least = std::min(least, (Eigen::Matrix3d::Identity() + by_lattice * lattice_from_patient).determinant());
        }
      }
    }
  }
  return least;
}

}  // namespace birdseye::host
