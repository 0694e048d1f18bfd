#include "host/deform/displacement_field.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace birdseye::host {

namespace {

/// The cell of a point in lattice coordinates and where in it; false outside the lattice.
bool cell_of(const std::array<int, 3>& size, const Eigen::Vector3d& x, std::array<int, 3>& base,
             Eigen::Vector3d& part) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const int last = size[axis] - 1;
    const double v = x[static_cast<Eigen::Index>(axis)];
    if (!(v >= 0 && v <= last)) return false;
    base[axis] = std::min(static_cast<int>(v), std::max(0, last - 1));
    part[static_cast<Eigen::Index>(axis)] = v - base[axis];
  }
  return true;
}

}  // namespace

Eigen::Vector3d DisplacementField::displacement(const Eigen::Vector3d& point_in_patient_mm) const {
  std::array<int, 3> base{};
  Eigen::Vector3d t;
  if (!cell_of(size, patient_from_lattice.inverse() * point_in_patient_mm, base, t)) return Eigen::Vector3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int c = 0; c < 8; ++c) {
    const int i = c & 1, j = c >> 1 & 1, k = c >> 2;
    const double w = (i != 0 ? t.x() : 1 - t.x()) * (j != 0 ? t.y() : 1 - t.y()) * (k != 0 ? t.z() : 1 - t.z());
    sum += w * at(base[0] + i, base[1] + j, base[2] + k).cast<double>();
  }
  return sum;
}

Eigen::Vector3d DisplacementField::deformed_of(const Eigen::Vector3d& rest_in_patient_mm) const {
  constexpr int kSteps = 200;
  constexpr double kCloseMm = 1e-4, kDamping = 0.7;
  Eigen::Vector3d x = rest_in_patient_mm;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d change = kDamping * (rest_in_patient_mm - displacement(x) - x);
    x += change;
    if (change.norm() < kCloseMm) break;
  }
  return x;
}

Eigen::Matrix3d DisplacementField::gradient(const Eigen::Vector3d& point_in_patient_mm) const {
  std::array<int, 3> base{};
  Eigen::Vector3d t;
  const Eigen::Affine3d lattice_from_patient = patient_from_lattice.inverse();
  if (!cell_of(size, lattice_from_patient * point_in_patient_mm, base, t)) return Eigen::Matrix3d::Zero();
  Eigen::Matrix3d by_lattice = Eigen::Matrix3d::Zero();
  for (int c = 0; c < 8; ++c) {
    const int bit[] = {c & 1, c >> 1 & 1, c >> 2};
    const Eigen::Vector3d u = at(base[0] + bit[0], base[1] + bit[1], base[2] + bit[2]).cast<double>();
    for (int axis = 0; axis < 3; ++axis) {
      double w = bit[axis] != 0 ? 1 : -1;
      for (int other = 0; other < 3; ++other) {
        if (other != axis) w *= bit[other] != 0 ? t[other] : 1 - t[other];
      }
      by_lattice.col(axis) += w * u;
    }
  }
  return by_lattice * lattice_from_patient.linear();
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

Result<void> check_covers(const DisplacementField& field, const Volume& volume) {
  const Eigen::Affine3d voxel_from_lattice = volume.patient_from_voxel.inverse() * field.patient_from_lattice;
  const Eigen::Array3d last_voxel(volume.size[0] - 1, volume.size[1] - 1, volume.size[2] - 1);
  constexpr double kMoves_mm = 0.5;
  Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::max()), high = -low;
  double torn_mm = 0;
  for (int k = 0; k < field.size[2]; ++k) {
    for (int j = 0; j < field.size[1]; ++j) {
      for (int i = 0; i < field.size[0]; ++i) {
        const Eigen::Array3d voxel = (voxel_from_lattice * Eigen::Vector3d(i, j, k)).array();
        low = low.min(voxel);
        high = high.max(voxel);
        const bool face =
            i == 0 || j == 0 || k == 0 || i == field.size[0] - 1 || j == field.size[1] - 1 || k == field.size[2] - 1;
        // A field may end a voxel short of the volume's faces.
        const bool inside = (voxel > 1).all() && (voxel < last_voxel - 1).all();
        if (face && inside) torn_mm = std::max(torn_mm, static_cast<double>(field.at(i, j, k).norm()));
      }
    }
  }
  if ((high < 0).any() || (low > last_voxel).any())
    return Error{Errc::bad_value, "the field lies outside of the volume; is it in another frame?"};
  if (torn_mm > kMoves_mm) {
    return Error{Errc::bad_value, fmt::format("the field stops inside the volume where it still moves it by {:.1f} mm; "
                                              "extend it to the volume's faces",
                                              torn_mm)};
  }
  return {};
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
