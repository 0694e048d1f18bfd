#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// Below this share of tissue a place is empty; half is its surface.
inline constexpr float kSurface = 0.3F;

/// What a laparoscope's light meets, for matching with video. For each point of a regular grid over the volume's box
/// (from the first voxel's centre to the last's): the share of its surroundings that belongs to the organ, smooth
/// enough for derivatives. An organ's inside is opaque, as it is to a camera, whatever the transfer function says.
struct Tissue {
  std::array<int, 3> points{};
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  /// From places on the grid, in mm along its axes, to the patient; a rigid motion.
  Eigen::Affine3d patient_from_grid = Eigen::Affine3d::Identity();
  std::vector<float> occupancy;     ///< 0 to 1, x fastest
  std::vector<std::uint8_t> level;  ///< 1 where occupancy is constant around the cell that begins at the point

  [[nodiscard]] Eigen::Vector3d box_mm() const {
    return spacing_mm.cwiseProduct(Eigen::Vector3d(points[0] - 1, points[1] - 1, points[2] - 1));
  }
};

/// 1 at each voxel of the CT that is tissue: that the transfer function shows and, where labels are given on the CT's
/// grid, that has one of values; 0 elsewhere.
std::vector<std::uint8_t> tissue_voxels(const Volume& ct, const Volume* labels, std::span<const int> values,
                                        const TransferFunction& transfer);

/// labels, where given, on the CT's grid: only voxels with one of values count. Errc::not_found where nothing is left
/// that the transfer function shows; Errc::bad_value for a volume whose axes are not at right angles.
Result<Tissue> tissue_of(const Volume& ct, const Volume* labels, std::span<const int> values,
                         const TransferFunction& transfer, double spacing_mm);

/// at[v] = tissue(v + move[v]), 0 outside of the box. moves: 3 numbers a point, mm along the grid's axes.
void warp(const Tissue& tissue, const std::vector<float>& moves, std::vector<float>& warped);
/// by_move[v] = by_warped[v] times the tissue's gradient at v + move[v].
void pull_back_warp(const Tissue& tissue, const std::vector<float>& moves, const std::vector<float>& by_warped,
                    std::vector<float>& by_move);

}  // namespace birdseye::host
