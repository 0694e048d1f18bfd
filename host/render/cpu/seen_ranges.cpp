#include "host/render/cpu/seen_ranges.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace birdseye::host::cpu {

namespace {

using Corners = Eigen::Array<float, 8, 1>;

constexpr float kNever = std::numeric_limits<float>::max();
/// Rays and bricks further from the axis than this share the outermost cells.
constexpr float kWidest = 4;
/// What rounding may take away, of a distance and of a cell.
constexpr float kMargin = 1e-4F;

}  // namespace

struct SeenRanges::Nearest {
  std::vector<float> near, far;
};

SeenRanges::SeenRanges(const float* directions, int blocks_per_row, int blocks) {
  struct Bounds {
    Eigen::Array2f low = Eigen::Array2f::Constant(kNever), high = -low;
  };
  std::vector<Bounds> of_block(static_cast<std::size_t>(blocks));
  Bounds all;
  for (std::size_t block = 0; block < of_block.size(); ++block) {
    const float* const at = directions + 48 * block;
    Bounds& bounds = of_block[block];
    for (int pixel = 0; pixel < 16; ++pixel) {
      const float z = at[32 + pixel];
      if (!(z > 0)) continue;
      const Eigen::Array2f plane = (Eigen::Array2f(at[pixel], at[16 + pixel]) / z).max(-kWidest).min(kWidest);
      bounds.low = bounds.low.min(plane);
      bounds.high = bounds.high.max(plane);
    }
    all.low = all.low.min(bounds.low);
    all.high = all.high.max(bounds.high);
  }
  blocks_.resize(of_block.size());
  if ((all.high < all.low).any()) return;  // a lens that sees nothing
  columns_ = blocks_per_row;
  rows_ = (blocks + blocks_per_row - 1) / blocks_per_row;
  first_ = all.low;
  cells_per_unit_ = Eigen::Array2f(static_cast<float>(columns_), static_cast<float>(rows_)) /
                    (all.high - all.low).max(std::numeric_limits<float>::min());
  for (std::size_t block = 0; block < of_block.size(); ++block) {
    const Bounds& bounds = of_block[block];
    if ((bounds.low <= bounds.high).all()) blocks_[block] = cells_of(bounds.low, bounds.high);
  }
}

SeenRanges::Cells SeenRanges::cells_of(const Eigen::Array2f& low, const Eigen::Array2f& high) const {
  const Eigen::Array2f last(static_cast<float>(columns_ - 1), static_cast<float>(rows_ - 1));
  const Eigen::Array2i from = ((low - first_) * cells_per_unit_ - kMargin).max(0.0F).min(last).cast<int>();
  const Eigen::Array2i to = ((high - first_) * cells_per_unit_ + kMargin).max(0.0F).min(last).cast<int>();
  return {from.x(), from.y(), to.x(), to.y()};
}

void SeenRanges::draw_row(const GridView& grid, const Eigen::Affine3f& camera_from_voxel, int by, int bz,
                          Nearest& nearest) const {
  // The corners of a brick from its first one, in the camera frame.
  Corners corner[3];
  for (int n = 0; n < 8; ++n) {
    const Eigen::Vector3f edges = Eigen::Vector3i(n & 1, n >> 1 & 1, n >> 2).cast<float>();
    const Eigen::Vector3f from_first = camera_from_voxel.linear() * (edges * kBrick);
    for (int axis = 0; axis < 3; ++axis) corner[axis][n] = from_first[axis];
  }
  const bool outer_row = by == 0 || bz == 0 || by == grid.bricks[1] - 1 || bz == grid.bricks[2] - 1;
  const std::uint8_t* const distance =
      grid.distance + (static_cast<std::ptrdiff_t>(bz) * grid.bricks[1] + by) * grid.bricks[0];
  for (int bx = 0; bx < grid.bricks[0]; ++bx) {
    if (distance[bx] < kSeenBrick) continue;
    const bool outer = outer_row || bx == 0 || bx == grid.bricks[0] - 1;
    if (distance[bx] > kSeenBrick && !outer) continue;  // within others
    const Eigen::Vector3f first = camera_from_voxel * (kBrick * Eigen::Vector3i(bx, by, bz)).cast<float>();
    const Corners x = corner[0] + first.x(), y = corner[1] + first.y(), z = corner[2] + first.z();
    const float furthest = std::sqrt((x.square() + y.square() + z.square()).maxCoeff()) * (1 + kMargin);
    const float z_least = z.minCoeff();
    Cells cells{0, 0, columns_ - 1, rows_ - 1};
    float closest = 0;
    if (z_least > kMargin * furthest) {  // else it is beside the camera or behind it
      const Corners u = (x / z).max(-kWidest).min(kWidest), v = (y / z).max(-kWidest).min(kWidest);
      cells = cells_of({u.minCoeff(), v.minCoeff()}, {u.maxCoeff(), v.maxCoeff()});
      closest = z_least * (1 - kMargin);
    } else if (z.maxCoeff() <= 0) {
      continue;
    }
    for (int row = cells.top; row <= cells.bottom; ++row) {
      float* const near = &nearest.near[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_)];
      float* const far = &nearest.far[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_)];
      for (int column = cells.left; column <= cells.right; ++column) {
        near[column] = std::min(near[column], closest);
        far[column] = std::max(far[column], furthest);
      }
    }
  }
}

std::vector<float> SeenRanges::of(const GridView& grid, const Eigen::Affine3d& camera_from_voxel) const {
  const auto cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  const Nearest nothing{std::vector<float>(cells, kNever), std::vector<float>(cells, -1.0F)};
  tbb::enumerable_thread_specific<Nearest> drawn(nothing);
  const Eigen::Affine3f single = camera_from_voxel.cast<float>();
  tbb::parallel_for(0, grid.bricks[2], [&](int bz) {
    Nearest& mine = drawn.local();
    for (int by = 0; by < grid.bricks[1]; ++by) draw_row(grid, single, by, bz, mine);
  });
  Nearest all = nothing;
  for (const Nearest& one : drawn) {
    for (std::size_t cell = 0; cell < cells; ++cell) {
      all.near[cell] = std::min(all.near[cell], one.near[cell]);
      all.far[cell] = std::max(all.far[cell], one.far[cell]);
    }
  }
  std::vector<float> ranges;
  ranges.reserve(2 * blocks_.size());
  for (const Cells& block : blocks_) {
    float near = kNever, far = -1;
    for (int row = block.top; row <= block.bottom; ++row) {
      for (int column = block.left; column <= block.right; ++column) {
        const std::size_t cell =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
        near = std::min(near, all.near[cell]);
        far = std::max(far, all.far[cell]);
      }
    }
    ranges.push_back(near);
    ranges.push_back(far);
  }
  return ranges;
}

}  // namespace birdseye::host::cpu
