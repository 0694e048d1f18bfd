#include "host/registration/similarity/joint_histogram.hpp"

#include <tbb/parallel_for.h>

#include <cassert>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr std::size_t kBlock = BinnedPicture::kBlock;

std::uint8_t bin_of(int grey, int bins) {
  return static_cast<std::uint8_t>(grey * bins >> 8);
}

std::array<std::uint8_t, 256> equal_bins(int bins) {
  std::array<std::uint8_t, 256> bin_of_grey;
  for (int grey = 0; grey < 256; ++grey) bin_of_grey[static_cast<std::size_t>(grey)] = bin_of(grey, bins);
  return bin_of_grey;
}

/// n log n. Most cells hold few pixels, and a logarithm costs as much as counting ten.
double n_log_n(std::uint32_t n) {
  static const std::array<double, 1024> table = [] {
    std::array<double, 1024> t{};
    for (std::size_t i = 1; i < t.size(); ++i) t[i] = static_cast<double>(i) * std::log(static_cast<double>(i));
    return t;
  }();
  return n < table.size() ? table[n] : n * std::log(static_cast<double>(n));
}

/// The counts of the pairs of some blocks. Neighbours are often alike, and an increment has to wait for the last one
/// of the same cell: so neighbours count in eight tables, of 16 bits to stay in the nearest caches. They are shifted by
/// half a row, for where cells of two tables lay whole pages apart the one would wait for the other too.
void count_blocks(const BinnedPicture& reference, std::span<const std::uint8_t> synthetic,
                  std::span<const std::size_t> blocks, std::size_t bins, std::span<std::uint32_t> counts) {
  constexpr std::size_t kTables = 8;
  const std::size_t stride = counts.size() + 96;
  std::vector<std::uint16_t> tables(kTables * stride);
  std::array<std::uint16_t*, kTables> table;
  for (std::size_t n = 0; n < kTables; ++n) table[n] = &tables[n * stride];
  const auto width = static_cast<std::uint16_t>(bins);
  std::array<std::uint8_t, kBlock> spare{};
  alignas(64) std::array<std::uint16_t, kBlock> cells;
  for (const std::size_t first : blocks) {
    const std::uint8_t* const rows = reference.bins(first);
    const std::uint8_t* const grey = reference.block(synthetic, first, spare);
    for (std::size_t i = 0; i < kBlock; ++i) {  // written so that compilers make SIMD of it
      const auto column = static_cast<std::uint16_t>(static_cast<std::uint16_t>(grey[i] * width) >> 8);
      cells[i] = static_cast<std::uint16_t>(static_cast<std::uint16_t>(rows[i] * width) + column);
    }
    for (std::size_t i = 0; i < kBlock; i += kTables) {
      for (std::size_t n = 0; n < kTables; ++n) ++table[n][cells[i + n]];
    }
  }
  for (std::size_t cell = 0; cell < counts.size(); ++cell) {
    std::uint32_t sum = 0;
    for (std::size_t n = 0; n < kTables; ++n) sum += table[n][cell];
    counts[cell] = sum;
  }
}

}  // namespace

JointHistogram::JointHistogram(std::span<const std::uint8_t> reference, std::span<const std::uint8_t> overlap, int bins)
    : bins_(static_cast<std::size_t>(bins)), reference_(reference, overlap, equal_bins(bins), bins) {
  assert(reference.size() == overlap.size() && bins >= 2 && bins <= 128 && reference_.pixels() > 0);
}

std::vector<std::uint32_t> JointHistogram::count(std::span<const std::uint8_t> synthetic) const {
  assert(synthetic.size() == reference_.size());
  // A task's share fits the 16 bits of its tables; few tasks, for their tables cost too, and an even number for two
  // cores.
  constexpr std::size_t kMostBlocks = 262144 / kBlock;
  const std::span<const std::size_t> blocks = reference_.blocks();
  const std::size_t tasks = 2 * ((blocks.size() + kMostBlocks - 1) / kMostBlocks);
  const std::size_t cells = (bins_ + 1) * bins_;
  std::vector<std::uint32_t> counts(tasks * cells);
  tbb::parallel_for(
      std::size_t{0}, tasks,
      [&](std::size_t task) {
        const std::size_t begin = task * blocks.size() / tasks, end = (task + 1) * blocks.size() / tasks;
        count_blocks(reference_, synthetic, blocks.subspan(begin, end - begin), bins_,
                     std::span(counts).subspan(task * cells, cells));
      },
      tbb::simple_partitioner());
  for (std::size_t task = 1; task < tasks; ++task) {
    for (std::size_t cell = 0; cell < bins_ * bins_; ++cell) counts[cell] += counts[task * cells + cell];
  }
  counts.resize(bins_ * bins_);
  return counts;
}

JointHistogram::Entropies JointHistogram::entropies(std::span<const std::uint8_t> synthetic) const {
  const std::vector<std::uint32_t> counts = count(synthetic);
  std::vector<std::uint32_t> of_synthetic(bins_);
  double reference = 0, joint = 0;
  for (std::size_t row = 0; row < bins_; ++row) {
    std::uint32_t of_reference = 0;
    for (std::size_t column = 0; column < bins_; ++column) {
      const std::uint32_t n = counts[row * bins_ + column];
      of_reference += n;
      of_synthetic[column] += n;
      joint += n_log_n(n);
    }
    reference += n_log_n(of_reference);
  }
  double synthetic_sum = 0;
  for (const std::uint32_t n : of_synthetic) synthetic_sum += n_log_n(n);
  const auto pixels = static_cast<double>(reference_.pixels());
  const auto entropy = [&](double sum) { return std::log(pixels) - sum / pixels; };
  return {entropy(reference), entropy(synthetic_sum), entropy(joint)};
}

}  // namespace birdseye::host
