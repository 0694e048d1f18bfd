#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "host/render/cpu/kernels.hpp"

namespace birdseye::host::cpu {

/// Tells for each block of 4x4 pixels between which distances its rays can see anything. The outermost of the bricks
/// that are seen are drawn as boxes, with their nearest and furthest distance, into a coarse picture of the camera's
/// plane z = 1. Rays start and end at these distances instead of feeling their way through the empty part of the
/// volume.
class SeenRanges {
 public:
  /// directions: as CastJob::directions.
  SeenRanges(const float* directions, int blocks_per_row, int blocks);

  /// Nearest and furthest distance for each block, two numbers a block, mm along the rays; furthest < nearest where
  /// nothing is seen.
  [[nodiscard]] std::vector<float> of(const GridView& grid, const Eigen::Affine3d& camera_from_voxel) const;

 private:
  struct Cells {
    int left = 0, top = 0, right = -1, bottom = -1;  ///< included
  };
  struct Nearest;
  [[nodiscard]] Cells cells_of(const Eigen::Array2f& low, const Eigen::Array2f& high) const;
  void draw_row(const GridView& grid, const Eigen::Affine3f& camera_from_voxel, int by, int bz, Nearest& nearest) const;

  int columns_ = 1, rows_ = 1;  ///< of the coarse picture
  Eigen::Array2f first_ = Eigen::Array2f::Zero(), cells_per_unit_ = Eigen::Array2f::Ones();
  std::vector<Cells> blocks_;
};

}  // namespace birdseye::host::cpu
