#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/signed_distance.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host {

/// What a laparoscope's light meets, for matching with video: for each point of a regular grid over the volume's box
/// (from the first voxel's centre to the last's) how deep it is within the organ. An organ's inside is opaque, as it is
/// to a camera, whatever the transfer function says.
struct Tissue {
  std::array<int, 3> points{};
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();
  /// From places on the grid, in mm along its axes, to the patient; a rigid motion.
  Eigen::Affine3d patient_from_grid = Eigen::Affine3d::Identity();
  /// Beyond this depth, and this distance outside, every place is alike.
  float reach_mm = 0;
  std::vector<float> depth_mm;  ///< -reach_mm to reach_mm, 0 at the organ's boundary, negative outside; x fastest
  /// Coefficients of cubic B-splines that warp() samples: trilinear blends of what it gives at the points are, on
  /// average over a cell, the depth.
  std::vector<float> spline_mm;
  std::vector<std::uint8_t> level;  ///< 1 where spline_mm is constant around the cell that begins at the point

  [[nodiscard]] Eigen::Vector3d box_mm() const {
    return spacing_mm.cwiseProduct(Eigen::Vector3d(points[0] - 1, points[1] - 1, points[2] - 1));
  }
};

/// 1 at each voxel of the CT that is tissue: that the transfer function shows and, where labels are given on the CT's
/// grid, that has one of values; 0 elsewhere.
std::vector<std::uint8_t> tissue_voxels(const Volume& ct, const Volume* labels, std::span<const int> values,
                                        const TransferFunction& transfer);

/// How far a place is from the boundary of the organ that the CT shows, on the grid that all registrations to views
/// work on. labels, values and transfer: as tissue_voxels() takes them. Errors are signed_distance_of()'s.
Result<SignedDistance> organ_distance(const Volume& ct, const Volume* labels, std::span<const int> values,
                                      const TransferFunction& transfer);

/// organ: of the same volume, whose box the grid covers.
Tissue tissue_of(const SignedDistance& organ, const Volume& ct, double spacing_mm);
/// From organ_distance(), with its errors.
Result<Tissue> tissue_of(const Volume& ct, const Volume* labels, std::span<const int> values,
                         const TransferFunction& transfer, double spacing_mm);

/// at[v] = tissue(v + move[v]), -reach_mm outside of the box. moves: 3 numbers a point, mm along the grid's axes.
void warp(const Tissue& tissue, const std::vector<float>& moves, std::vector<float>& warped);
/// by_move[v] = by_warped[v] times the tissue's gradient at v + move[v].
void pull_back_warp(const Tissue& tissue, const std::vector<float>& moves, const std::vector<float>& by_warped,
                    std::vector<float>& by_move);

}  // namespace birdseye::host
