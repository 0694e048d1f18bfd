#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// How far a place is from an organ's boundary, patient mm: negative inside. Trilinear between the points of a regular
/// grid over a box.
class SignedDistance {
 public:
  /// distances_mm: one a point, x fastest, 2 points an axis at least. patient_from_box: rigid, from mm along the box's
  /// axes, from its first point on.
  SignedDistance(const std::array<int, 3>& points, double spacing_mm, const Eigen::Affine3d& patient_from_box,
                 std::span<const float> distances_mm);

  struct Sample {
    double distance_mm;
    Eigen::Vector3d gradient;  ///< patient frame; about 1 long near the boundary
  };
  /// Outside of the box: of the nearest place in it, with the way there on top.
  [[nodiscard]] Sample sample(const Eigen::Vector3d& place_in_patient_mm) const;
  [[nodiscard]] double distance_mm(const Eigen::Vector3d& place_in_patient_mm) const;

  [[nodiscard]] const std::array<int, 3>& points() const { return points_; }
  [[nodiscard]] double spacing_mm() const { return spacing_mm_; }
  [[nodiscard]] const Eigen::Affine3d& patient_from_box() const { return patient_from_box_; }
  [[nodiscard]] const Eigen::Vector3d& box_mm() const { return box_mm_; }

 private:
  struct Cell {
    std::size_t base;
    float t[3];
    Eigen::Vector3d beyond_mm;
  };
  [[nodiscard]] Cell cell_of(const Eigen::Vector3d& place_in_patient_mm) const;

  std::array<int, 3> points_{};
  double spacing_mm_ = 1;
  Eigen::Vector3d box_mm_ = Eigen::Vector3d::Zero();
  Eigen::Affine3d patient_from_box_ = Eigen::Affine3d::Identity(), box_from_patient_ = Eigen::Affine3d::Identity();
  std::vector<Eigen::Vector4f> values_;  ///< of each point the gradient along the box's axes, then the distance
};

/// From the boundary of a mask: one value a voxel of the grid, not 0 where the organ is. The boundary is where the
/// mask, smoothed by a Gaussian of a millimetre or half a voxel, is a half; between voxels. The box holds the organ and
/// a margin about it; past the volume's faces the organ goes on as it ends there. Errc::not_found for a mask that is
/// empty, full or too thin; Errc::bad_value for a grid whose axes are not at right angles or have fewer than 4 voxels.
Result<SignedDistance> signed_distance_of(const Volume& grid, std::span<const std::uint8_t> mask, double spacing_mm,
                                          double margin_mm);

}  // namespace birdseye::host
