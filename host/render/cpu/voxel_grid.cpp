#include "host/render/cpu/voxel_grid.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>

namespace birdseye::host::cpu {

namespace {

void copy(const Eigen::Matrix3f& m, float (*rows)[3]) {
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rows[row][column] = m(row, column);
  }
}

void copy(const Eigen::Vector3f& v, float* to) {
  std::copy_n(v.data(), 3, to);
}

}  // namespace

VoxelGrid::VoxelGrid(const Volume& volume, const TransferFunction& transfer, const Kernels& kernels, bool prune)
    : volume_(volume), transfer_(transfer), kernels_(kernels), scan_seen_(volume, transfer), prune_(prune) {
  static_assert(SeenBricks::kBrick == kBrick);
  static_assert(kLowestHu == TransferFunction::kLowestHu && kHighestHu == TransferFunction::kHighestHu);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    view_.size[axis] = volume.size[axis];
    bricks_[axis] = scan_seen_.size()[axis];
    tiles_[axis] = (volume.size[axis] + kBrick - 1) / kBrick;
    view_.bricks[axis] = bricks_[axis];
  }
  view_.row = volume.size[0] + 2;
  view_.slice = (view_.row * (volume.size[1] + 2) + kSliceUnit - 1) / kSliceUnit * kSliceUnit;
  constexpr std::size_t kPastTheEnd = 64;  // packets read past the last voxel, and use nothing of it
  voxels_.resize(static_cast<std::size_t>(view_.slice) * static_cast<std::size_t>(volume.size[2] + 2) + kPastTheEnd);
  view_.voxels = voxels_.data() + view_.slice + view_.row + 1;
  undeform();
}

std::uint32_t* VoxelGrid::voxel_row(int y, int z) {
  return view_.voxels + static_cast<std::ptrdiff_t>(z) * view_.slice + static_cast<std::ptrdiff_t>(y) * view_.row;
}

void VoxelGrid::undeform() {
  if (!holds_scan_) {
    const auto& n = volume_.size;
    tbb::parallel_for(0, n[2], [&](int z) {
      for (int y = 0; y < n[1]; ++y) {
        const std::int16_t* const from = &volume_.hu[volume_.index(0, y, z)];
        std::uint32_t* const to = voxel_row(y, z);
        for (int x = 0; x < n[0]; ++x)
          to[x] = static_cast<std::uint32_t>(std::clamp<int>(from[x], kLowestHu, kHighestHu) - kLowestHu) << kHuBits;
      }
    });
    copy_border();
    holds_scan_ = true;
  }
  seen_ = scan_seen_.flags();
  if (!prune_) std::fill(seen_.begin(), seen_.end(), std::uint8_t{1});
  measure_distances();
}

void VoxelGrid::copy_border() {
  const auto& n = volume_.size;
  tbb::parallel_for(0, n[2], [&](int z) {
    for (int y = 0; y < n[1]; ++y) {
      std::uint32_t* const row = voxel_row(y, z);
      row[-1] = row[0];
      row[n[0]] = row[n[0] - 1];
    }
    std::copy_n(voxel_row(0, z) - 1, view_.row, voxel_row(-1, z) - 1);
    std::copy_n(voxel_row(n[1] - 1, z) - 1, view_.row, voxel_row(n[1], z) - 1);
  });
  std::copy_n(voxel_row(-1, 0) - 1, view_.slice, voxel_row(-1, -1) - 1);
  std::copy_n(voxel_row(-1, n[2] - 1) - 1, view_.slice, voxel_row(-1, n[2]) - 1);
}

/// Of a row of voxels, the tiles that seen bricks need when a brick needs its voxels and `margin` more on either side.
void VoxelGrid::tiles_of_row(int y, int z, int margin, std::uint8_t* tiles) const {
  const int nx = bricks_[0];
  // Brick b has voxels 4b to 4b + 4.
  const auto first = [margin](int voxel) { return std::max(0, (voxel - margin - 1) / kBrick); };
  const auto last = [margin](int voxel, int bricks) { return std::min(bricks - 1, (voxel + margin) / kBrick); };
  std::fill(tiles, tiles + tiles_[0], std::uint8_t{0});
  for (int bk = first(z); bk <= last(z, bricks_[2]); ++bk) {
    for (int bj = first(y); bj <= last(y, bricks_[1]); ++bj) {
      const std::uint8_t* const bricks = &seen_[grid_index(bricks_, 0, bj, bk)];
      for (int bi = 0; bi < nx; ++bi) tiles[bi] |= bricks[bi];
    }
  }
  // A brick reaches into the tile after it, and with a margin into the one before it.
  std::uint8_t before = 0;
  for (int tile = 0; tile < tiles_[0]; ++tile) {
    const std::uint8_t here = tiles[tile];
    const std::uint8_t after = margin > 0 && tile + 1 < nx ? tiles[tile + 1] : std::uint8_t{0};
    tiles[tile] = here | before | after;
    before = here;
  }
}

/// Calls run for each run of tiles that are set.
template <typename Run>
void VoxelGrid::for_runs(const std::uint8_t* tiles, const Run& run) const {
  for (int begin = 0; begin < tiles_[0];) {
    if (tiles[begin] == 0) {
      ++begin;
      continue;
    }
    int end = begin;
    while (end < tiles_[0] && tiles[end] != 0) ++end;
    run(begin * kBrick, std::min(end * kBrick, volume_.size[0]));
    begin = end;
  }
}

void VoxelGrid::mark_seen_after(const DisplacementField& field, const Eigen::Affine3d& lattice_from_voxel) {
  // The field's bounds over blocks of bricks tell from where the values of each brick may come.
  constexpr int kBlock = 4;
  constexpr float kMargin = 1e-3F;
  const Counts blocks{(bricks_[0] + kBlock - 1) / kBlock, (bricks_[1] + kBlock - 1) / kBlock,
                      (bricks_[2] + kBlock - 1) / kBlock};
  const Eigen::Array3i last_voxel(volume_.size[0] - 1, volume_.size[1] - 1, volume_.size[2] - 1);
  const Eigen::Array3i last_point(field.size[0] - 1, field.size[1] - 1, field.size[2] - 1);
  const auto block = [&](const Eigen::Array3i& at) {
    const Eigen::Array3i low_voxel = at * (kBlock * kBrick);
    const Eigen::Array3i high_voxel = (low_voxel + kBlock * kBrick).min(last_voxel);
    Eigen::Array3d low = Eigen::Array3d::Constant(1e30), high = -low;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Array3d pick(corner & 1, corner >> 1 & 1, corner >> 2);
      const Eigen::Array3d voxel = low_voxel.cast<double>() + pick * (high_voxel - low_voxel).cast<double>();
      const Eigen::Array3d lattice = (lattice_from_voxel * Eigen::Vector3d(voxel)).array();
      low = low.min(lattice);
      high = high.max(lattice);
    }
    const bool beyond = (low < 0).any() || (high > last_point.cast<double>()).any();
    const Eigen::Array3i first = low.max(0).min(last_point.cast<double>()).floor().cast<int>();
    const Eigen::Array3i last = high.max(0).min(last_point.cast<double>()).ceil().cast<int>();
    Eigen::Array3f least = Eigen::Array3f::Constant(beyond ? 0 : 1e30F);
    Eigen::Array3f most = -least;
    for (int k = first[2]; k <= last[2]; ++k) {
      for (int j = first[1]; j <= last[1]; ++j) {
        for (int i = first[0]; i <= last[0]; ++i) {
          const std::size_t point = grid_index(field.size, i, j, k);
          const Eigen::Array3f move(moves_[0][point], moves_[1][point], moves_[2][point]);
          least = least.min(move);
          most = most.max(move);
        }
      }
    }
    const Eigen::Array3i end = ((at + 1) * kBlock).min(Eigen::Array3i(bricks_[0], bricks_[1], bricks_[2]));
    for (int bk = at[2] * kBlock; bk < end[2]; ++bk) {
      for (int bj = at[1] * kBlock; bj < end[1]; ++bj) {
        for (int bi = at[0] * kBlock; bi < end[0]; ++bi) {
          const Eigen::Array3i brick(bi, bj, bk);
          const Eigen::Array3f from = (brick * kBrick).cast<float>() + least - kMargin;
          const Eigen::Array3f to = (brick * kBrick + kBrick).min(last_voxel).cast<float>() + most + kMargin;
          const bool past = (from < -2 * kMargin).any() || (to > last_voxel.cast<float>() + 2 * kMargin).any();
          // Where values come from past the volume's faces there is air, and what lies between it and tissue.
          seen_[grid_index(bricks_, bi, bj, bk)] = !prune_ || past || scan_seen_.any(from, to) ? 1 : 0;
        }
      }
    }
  };
  tbb::parallel_for(0, blocks[1] * blocks[2], [&](int n) {
    for (int i = 0; i < blocks[0]; ++i) block({i, n % blocks[1], n / blocks[1]});
  });
}

void VoxelGrid::deform(const DisplacementField& field) {
  assert(*std::min_element(volume_.size.begin(), volume_.size.end()) >= 2);
  const Eigen::Affine3d lattice_from_voxel = field.patient_from_lattice.inverse() * volume_.patient_from_voxel;
  const Eigen::Matrix3f voxel_from_patient = volume_.patient_from_voxel.linear().inverse().cast<float>();
  for (std::vector<float>& axis : moves_) axis.resize(field.displacement_mm.size());
  for (std::size_t i = 0; i < field.displacement_mm.size(); ++i) {
    const Eigen::Vector3f move = voxel_from_patient * field.displacement_mm[i];
    for (int axis = 0; axis < 3; ++axis) moves_[axis][i] = move[axis];
  }
  mark_seen_after(field, lattice_from_voxel);

  WarpJob job;
  job.grid = view_;
  job.source = volume_.hu.data();
  const Eigen::Matrix3f linear = lattice_from_voxel.linear().cast<float>();
  copy(linear, job.lattice_from_voxel);
  const Eigen::Matrix3f turned = linear - Eigen::Matrix3f(linear.diagonal().asDiagonal());
  // A drift of a thousandth of a lattice cell from end to end of the volume is nothing.
  const Eigen::Vector3f extent(static_cast<float>(volume_.size[0]), static_cast<float>(volume_.size[1]),
                               static_cast<float>(volume_.size[2]));
  job.aligned = (turned.cwiseAbs() * extent).maxCoeff() < 1e-3F && field.size[0] <= kLongestAligned;
  copy(Eigen::Vector3f(lattice_from_voxel.translation().cast<float>()), job.lattice_origin);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    job.field_size[axis] = field.size[axis];
    job.moves[axis] = moves_[axis].data();
  }
  // What is not resampled is air: samples between two looks at the bricks may stray into it.
  const auto nx = static_cast<std::size_t>(tiles_[0]);
  if (holds_scan_)
    resampled_.assign(nx * static_cast<std::size_t>(volume_.size[1]) * static_cast<std::size_t>(volume_.size[2]), 1);
  tbb::parallel_for(0, volume_.size[2], [&](int z) {
    std::vector<std::uint8_t> wanted(nx), stale(nx);
    for (int y = 0; y < volume_.size[1]; ++y) {
      // A cell's corners, and the neighbours from which their light is computed.
      tiles_of_row(y, z, 1, wanted.data());
      std::uint8_t* const held = &resampled_[(static_cast<std::size_t>(z) * static_cast<std::size_t>(volume_.size[1]) +
                                              static_cast<std::size_t>(y)) *
                                             nx];
      for (std::size_t i = 0; i < nx; ++i) {
        stale[i] = held[i] != 0 && wanted[i] == 0 ? 1 : 0;
        held[i] = wanted[i];
      }
      for_runs(stale.data(), [&](int x_begin, int x_end) {
        std::fill(voxel_row(y, z) + x_begin, voxel_row(y, z) + x_end, std::uint32_t{0});
      });
      for_runs(wanted.data(), [&](int x_begin, int x_end) { kernels_.warp(job, x_begin, x_end, y, z); });
    }
  });
  holds_scan_ = false;
  copy_border();
  refine_seen();
  measure_distances();
}

void VoxelGrid::refine_seen() {
  const auto& n = volume_.size;
  tbb::parallel_for(0, bricks_[2], [&](int bk) {
    std::vector<int> low(static_cast<std::size_t>(n[0])), high(static_cast<std::size_t>(n[0]));
    for (int bj = 0; bj < bricks_[1]; ++bj) {
      std::uint8_t* const seen = &seen_[grid_index(bricks_, 0, bj, bk)];
      for (int begin = 0; begin < bricks_[0];) {
        if (seen[begin] == 0) {
          ++begin;
          continue;
        }
        int end = begin;
        while (end < bricks_[0] && seen[end] != 0) ++end;
        const int x_begin = begin * kBrick;
        const int x_end = std::min(end * kBrick + 1, n[0]);
        kernels_.bounds(view_, x_begin, x_end, bj * kBrick, std::min(bj * kBrick + kBrick + 1, n[1]), bk * kBrick,
                        std::min(bk * kBrick + kBrick + 1, n[2]), low.data(), high.data());
        for (int bi = begin; bi < end; ++bi) {
          const std::ptrdiff_t from = std::ptrdiff_t{bi - begin} * kBrick;
          const auto to = static_cast<std::ptrdiff_t>(std::min(bi * kBrick + kBrick + 1, n[0]) - x_begin);
          seen[bi] = !prune_ || transfer_.any_seen(*std::min_element(low.begin() + from, low.begin() + to),
                                                   *std::max_element(high.begin() + from, high.begin() + to))
                         ? 1
                         : 0;
        }
        begin = end;
      }
    }
  });
}

/// Grows what is set, one bit a brick, by a brick along all three axes at a time, and tells of each brick at which step
/// it is reached: how far it is, as a cube measures. Bricks that are set stay at 0.
void VoxelGrid::grow(std::vector<std::uint64_t> bits, std::uint8_t furthest, const Reached& reached) const {
  const auto nx = static_cast<std::size_t>(bricks_[0]), ny = static_cast<std::size_t>(bricks_[1]),
             nz = static_cast<std::size_t>(bricks_[2]);
  const std::size_t words = (nx + 63) / 64;
  std::vector<std::uint64_t> next(bits.size()), before;
  // A word or'ed with those that lie `stride` before and after it in a line of `line` words.
  const auto spread = [&](std::size_t stride, std::size_t line) {
    for (std::size_t at = 0; at < bits.size(); ++at) {
      const std::size_t place = at / stride % line;
      std::uint64_t word = bits[at];
      if (place > 0) word |= bits[at - stride];
      if (place + 1 < line) word |= bits[at + stride];
      next[at] = word;
    }
    bits.swap(next);
  };
  for (std::uint8_t step = 1; step <= furthest; ++step) {
    before = bits;
    for (std::size_t at = 0; at < bits.size(); ++at) {
      const std::uint64_t word = bits[at];
      std::uint64_t more = word | word << 1U | word >> 1U;
      if (at % words > 0) more |= bits[at - 1] >> 63U;
      if (at % words + 1 < words) more |= bits[at + 1] << 63U;
      next[at] = more;
    }
    bits.swap(next);
    spread(words, ny);
    spread(words * ny, nz);
    bool changed = false;
    for (std::size_t at = 0; at < bits.size(); ++at) {
      for (std::uint64_t fresh = bits[at] & ~before[at]; fresh != 0; fresh &= fresh - 1) {
        const std::size_t i = at % words * 64 + static_cast<std::size_t>(std::countr_zero(fresh));
        if (i >= nx) break;
        reached(at / words * nx + i, step);
        changed = true;
      }
    }
    if (!changed) break;
  }
}

void VoxelGrid::measure_distances() {
  constexpr std::uint8_t kFurthest = 24;  // leaps of 96 voxels are far enough
  constexpr std::uint8_t kDeepest = 12;
  const auto nx = static_cast<std::size_t>(bricks_[0]);
  const std::size_t words = (nx + 63) / 64;
  std::vector<std::uint64_t> seen(seen_.size() / nx * words, 0), empty(seen.size(), 0);
  // A byte is loaded with the three after it.
  distance_.assign(seen_.size() + 4, kFurthest + 1);
  for (std::size_t n = 0; n < seen_.size(); ++n) {
    auto& bits = seen_[n] != 0 ? seen : empty;
    bits[n / nx * words + n % nx / 64] |= std::uint64_t{1} << n % nx % 64;
    if (seen_[n] != 0) distance_[n] = kSeenBrick + kDeepest;
  }
  // Past the volume's faces nothing needs to be looked at: rays end there.
  grow(std::move(seen), kFurthest, [this](std::size_t brick, std::uint8_t step) { distance_[brick] = step; });
  grow(std::move(empty), kDeepest, [this](std::size_t brick, std::uint8_t step) {
    distance_[brick] = static_cast<std::uint8_t>(kSeenBrick + step - 1);
  });
  view_.distance = distance_.data();
}

void VoxelGrid::light(const Eigen::Vector3d& eye_in_patient_mm, const RenderSettings& settings) {
  std::array<float, kFacings + 1> highlight;
  for (int i = 0; i <= kFacings; ++i) {
    highlight[static_cast<std::size_t>(i)] =
        static_cast<float>(settings.specular * std::pow(static_cast<double>(i) / kFacings, settings.shininess));
  }
  LightJob job;
  job.grid = view_;
  const Eigen::Affine3d& patient_from_voxel = volume_.patient_from_voxel;
  copy(Eigen::Matrix3f(patient_from_voxel.linear().cast<float>()), job.patient_from_voxel);
  copy(Eigen::Vector3f((patient_from_voxel.translation() - eye_in_patient_mm).cast<float>()), job.first_from_eye_mm);
  constexpr double kPerStored = 0.5 / (1 << kHuBits);
  copy(Eigen::Matrix3f((kPerStored * patient_from_voxel.linear().inverse().transpose()).cast<float>()),
       job.patient_gradient);
  job.per_surface_gradient = static_cast<float>(1 / settings.surface_gradient_hu_per_mm);
  job.ambient = static_cast<float>(settings.ambient);
  job.diffuse = static_cast<float>(settings.diffuse);
  job.highlight = highlight.data();
  // A row's light is written into the words that the rows beside it read their HU from: slabs that touch take turns.
  const int slabs = (volume_.size[2] + kBrick - 1) / kBrick;
  for (const int turn : {0, 1}) {
    tbb::parallel_for(0, (slabs - turn + 1) / 2, [&](int n) {
      std::vector<std::uint8_t> wanted(static_cast<std::size_t>(tiles_[0]));
      const int begin = (2 * n + turn) * kBrick;
      for (int z = begin; z < std::min(begin + kBrick, volume_.size[2]); ++z) {
        for (int y = 0; y < volume_.size[1]; ++y) {
          tiles_of_row(y, z, 0, wanted.data());
          for_runs(wanted.data(), [&](int x_begin, int x_end) { kernels_.light(job, x_begin, x_end, y, z); });
        }
      }
    });
  }
  copy_border();
}

std::size_t VoxelGrid::bytes() const {
  std::size_t bytes = voxels_.capacity() * sizeof(std::uint32_t) + scan_seen_.bytes();
  for (const auto* flags : {&seen_, &distance_, &resampled_}) bytes += flags->capacity();
  for (const std::vector<float>& axis : moves_) bytes += axis.capacity() * sizeof(float);
  return bytes;
}

}  // namespace birdseye::host::cpu
