#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/dicom/patient_identity.hpp"

namespace birdseye::host {

/// The index of (i, j, k) among the values of a grid of this size, x fastest.
inline std::size_t grid_index(const std::array<int, 3>& size, int i, int j, int k) {
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(size[1]) + static_cast<std::size_t>(j)) *
             static_cast<std::size_t>(size[0]) +
         static_cast<std::size_t>(i);
}
inline std::size_t grid_count(const std::array<int, 3>& size) {
  return grid_index(size, 0, 0, size[2]);
}

/// A CT: Hounsfield units on a regular grid. x fastest; voxel centres at integers; patient frame is DICOM LPS, mm.
struct Volume {
  std::array<int, 3> size{};
  std::vector<std::int16_t> hu;
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  Eigen::Affine3d patient_from_voxel = Eigen::Affine3d::Identity();
  PatientFrame frame;  ///< to which patient_from_voxel leads

  [[nodiscard]] std::size_t index(int i, int j, int k) const { return grid_index(size, i, j, k); }
  [[nodiscard]] std::int16_t at(int i, int j, int k) const { return hu[index(i, j, k)]; }
};

/// Which way each voxel axis mostly points, as three letters of R/L, A/P, I/S: "LPS" for DICOM's own axes.
std::string orientation_letters(const Eigen::Affine3d& patient_from_voxel);
/// Columns: which way the voxel axes point by three such letters; empty where they are none, as "LPP".
std::optional<Eigen::Matrix3d> axes_of_letters(std::string_view letters);

}  // namespace birdseye::host
