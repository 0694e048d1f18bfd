#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/deform/patch_octree.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Displacements on a regular lattice over a box of the patient, trilinear between its points, zero outside. At a
/// static point p the picture shows what the undeformed volume has at p + u(p). Every octree of patches is exactly such
/// a field.
struct DisplacementField {
  std::array<int, 3> size{};
  std::vector<Eigen::Vector3f> displacement_mm;  ///< patient LPS, x fastest
  Eigen::Affine3d patient_from_lattice = Eigen::Affine3d::Identity();

  [[nodiscard]] const Eigen::Vector3f& at(int i, int j, int k) const {
    return displacement_mm[grid_index(size, i, j, k)];
  }
  [[nodiscard]] Eigen::Vector3d displacement(const Eigen::Vector3d& point_in_patient_mm) const;
  /// The place at which a point of the undeformed volume is seen: the p with p + u(p) = rest, to 1e-4 mm, by damped
  /// fixed-point steps.
  [[nodiscard]] Eigen::Vector3d deformed_of(const Eigen::Vector3d& rest_in_patient_mm) const;
  /// du/dp within the lattice cell of the point; zero outside the box.
  [[nodiscard]] Eigen::Matrix3d gradient(const Eigen::Vector3d& point_in_patient_mm) const;
};

/// The field of tree laid over a box; patient_from_cube takes the tree's unit cube to that box.
DisplacementField field_of(const PatchOctree& tree, const Eigen::Affine3d& patient_from_cube);

/// As an ITK displacement field: a vector image, LPS mm, which any program on ITK reads (.mha, .nrrd, .nii.gz). Reading
/// refuses, naming the file: what is no such image, numbers that are not finite, and fields that fold.
Result<void> write_field(const std::filesystem::path& path, const DisplacementField& field);
Result<DisplacementField> read_field(const std::filesystem::path& path);
/// What reading refuses of numbers that make no field, without a file's name.
Result<void> check_sound(const DisplacementField& field);

/// Checks that the field fits the volume. Refuses (Errc::bad_value) a field that lies outside the volume, and one that
/// ends inside it with a displacement that is not zero, for there the picture would tear.
Result<void> check_covers(const DisplacementField& field, const Volume& volume);

/// The least Jacobian determinant of p + u(p) over the corners of the lattice's cells.
double least_determinant(const DisplacementField& field);

}  // namespace birdseye::host
