#include "host/render/scene/seen_bricks.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace birdseye::host {

SeenBricks::SeenBricks(const Volume& volume, const TransferFunction& transfer) {
  const auto& n = volume.size;
  for (std::size_t axis = 0; axis < 3; ++axis) size_[axis] = std::max(1, (n[axis] - 1 + kBrick - 1) / kBrick);
  flags_.resize(grid_count(size_));
  tbb::parallel_for(0, size_[2], [&](int bk) {
    for (int bj = 0; bj < size_[1]; ++bj) {
      for (int bi = 0; bi < size_[0]; ++bi) {
        std::int16_t low = std::numeric_limits<std::int16_t>::max();
        std::int16_t high = std::numeric_limits<std::int16_t>::min();
        for (int k = bk * kBrick; k <= std::min(bk * kBrick + kBrick, n[2] - 1); ++k) {
          for (int j = bj * kBrick; j <= std::min(bj * kBrick + kBrick, n[1] - 1); ++j) {
            for (int i = bi * kBrick; i <= std::min(bi * kBrick + kBrick, n[0] - 1); ++i) {
              low = std::min(low, volume.at(i, j, k));
              high = std::max(high, volume.at(i, j, k));
            }
          }
        }
        flags_[grid_index(size_, bi, bj, bk)] = transfer.any_seen(low, high) ? 1 : 0;
      }
    }
  });
  const std::array<int, 3> sums{size_[0] + 1, size_[1] + 1, size_[2] + 1};
  before_.assign(grid_count(sums), 0);
  for (int k = 1; k < sums[2]; ++k) {
    for (int j = 1; j < sums[1]; ++j) {
      int line = 0;
      for (int i = 1; i < sums[0]; ++i) {
        line += flags_[grid_index(size_, i - 1, j - 1, k - 1)];
        before_[grid_index(sums, i, j, k)] = line + before(i, j - 1, k) + before(i, j, k - 1) - before(i, j - 1, k - 1);
      }
    }
  }
}

int SeenBricks::before(int i, int j, int k) const {
  return before_[grid_index({size_[0] + 1, size_[1] + 1, size_[2] + 1}, i, j, k)];
}

bool SeenBricks::any(const Eigen::Array3f& low, const Eigen::Array3f& high) const {
  const Eigen::Array3i last(size_[0] - 1, size_[1] - 1, size_[2] - 1);
  const auto brick_of = [&last](const Eigen::Array3f& voxel) {
    return Eigen::Array3i((voxel.max(0.0F) / static_cast<float>(kBrick)).floor().cast<int>().min(last));
  };
  const Eigen::Array3i a = brick_of(low);
  const Eigen::Array3i b = brick_of(high) + 1;
  return before(b[0], b[1], b[2]) - before(a[0], b[1], b[2]) - before(b[0], a[1], b[2]) - before(b[0], b[1], a[2]) +
             before(a[0], a[1], b[2]) + before(a[0], b[1], a[2]) + before(b[0], a[1], a[2]) - before(a[0], a[1], a[2]) >
         0;
}

}  // namespace birdseye::host
