#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "host/deform/displacement_field.hpp"
#include "host/render/cpu/kernels.hpp"
#include "host/render/scene/scene.hpp"
#include "host/render/scene/seen_bricks.hpp"
#include "host/render/scene/transfer_function.hpp"
#include "host/volume/volume.hpp"

namespace birdseye::host::cpu {

/// The volume as the ray caster walks through it: HU with light, and which bricks are seen. Deforming the grid
/// resamples the bricks that the deformed volume may show; casting rays costs the same whatever the deformation.
class VoxelGrid {
 public:
  /// Keeps references to all three.
  /// prune: false treats all bricks as seen, which changes the time and not the picture.
  VoxelGrid(const Volume& volume, const TransferFunction& transfer, const Kernels& kernels, bool prune);

  void deform(const DisplacementField& field);
  /// Back to the volume as it was scanned.
  void undeform();
  /// Puts the light of a lamp at the eye (patient frame, mm) on every voxel that is seen.
  void light(const Eigen::Vector3d& eye_in_patient_mm, const RenderSettings& settings);

  [[nodiscard]] const GridView& view() const { return view_; }
  /// Memory beyond the volume's own.
  [[nodiscard]] std::size_t bytes() const;

 private:
  using Counts = std::array<int, 3>;
  void tiles_of_row(int y, int z, int margin, std::uint8_t* tiles) const;
  template <typename Run>
  void for_runs(const std::uint8_t* tiles, const Run& run) const;
  [[nodiscard]] std::uint32_t* voxel_row(int y, int z);
  void copy_border();
  void mark_seen_after(const DisplacementField& field, const Eigen::Affine3d& lattice_from_voxel);
  void refine_seen();
  using Reached = std::function<void(std::size_t brick, std::uint8_t step)>;
  void grow(std::vector<std::uint64_t> bits, std::uint8_t furthest, const Reached& reached) const;
  void measure_distances();

  const Volume& volume_;
  const TransferFunction& transfer_;
  const Kernels& kernels_;
  std::vector<std::uint32_t> voxels_;
  std::vector<std::uint8_t> seen_;      ///< of each brick of cells, as the grid is now
  std::vector<std::uint8_t> distance_;  ///< GridView::distance
  SeenBricks scan_seen_;
  std::vector<std::uint8_t> resampled_;  ///< of each row's tiles of voxels: hold a deformation's values
  std::vector<float> moves_[3];
  bool prune_;
  bool holds_scan_ = false;
  Counts bricks_{}, tiles_{};  ///< of kBrick cells, of kBrick voxels
  GridView view_;
};

}  // namespace birdseye::host::cpu
