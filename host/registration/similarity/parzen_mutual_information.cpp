#include "host/registration/similarity/parzen_mutual_information.hpp"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cassert>
#include <cmath>

namespace birdseye::host {

namespace {

constexpr std::size_t kBlock = BinnedPicture::kBlock;
/// Always the same tasks, added up in their order: the sum then does not depend on the threads.
constexpr std::size_t kTasks = 16;

/// The window's derivative over the four bins around a grey at `part` of its cell is kSlope * (1, part, part^2).
constexpr double kSlope[4][3] = {{-0.5, 1, -0.5}, {0, -2, 1.5}, {0.5, 1, -1.5}, {0, 0, 0.5}};

/// Six times the windows over the four bins around each cell, summed over the cell's pixels. Neighbouring pixels then
/// add to the same four numbers or to four others, where in a table of bins each would wait for a part of the other. No
/// window is a difference of larger numbers, so that what should be zero is.
struct alignas(32) Windows {
  static constexpr std::size_t kBin[4] = {0, 3, 2, 1};  ///< of each sum: two by two they are alike
  double sum[4] = {};
  void add(double part) {
    const double from_knot[2] = {1 - part, part};
    for (int side = 0; side < 2; ++side) {
      const double square = from_knot[side] * from_knot[side], cube = square * from_knot[side];
      sum[side] += cube;
      sum[2 + side] += 4 - 6 * square + 3 * cube;
    }
  }
  void add(const Windows& other) {
    for (int n = 0; n < 4; ++n) sum[n] += other.sum[n];
  }
};

/// d(value) / d(grey) of a pixel of some cell is a + b part + c part^2.
struct alignas(32) Slope {
  double a = 0, b = 0, c = 0, unused = 0;
};

std::array<std::uint8_t, 256> equal_frequency_bins(const Reference& reference, int bins) {
  std::array<std::size_t, 256> pixels{};
  std::size_t all = 0;
  for (std::size_t i = 0; i < reference.grey.size(); ++i) {
    if (reference.overlap[i] == 0) continue;
    ++pixels[reference.grey[i]];
    ++all;
  }
  all = std::max<std::size_t>(all, 1);
  // A grey's bin is that of the middle one of its pixels, in order of brightness.
  std::array<std::uint8_t, 256> bin_of_grey;
  std::size_t darker = 0;
  for (std::size_t grey = 0; grey < 256; ++grey) {
    const std::size_t bin = (2 * darker + pixels[grey]) * static_cast<std::size_t>(bins) / (2 * all);
    bin_of_grey[grey] = static_cast<std::uint8_t>(std::min(bin, static_cast<std::size_t>(bins - 1)));
    darker += pixels[grey];
  }
  return bin_of_grey;
}

/// work(first block, past the last, number of the task) for each task.
template <typename Work>
void in_tasks(std::size_t blocks, const Work& work) {
  tbb::parallel_for(
      std::size_t{0}, kTasks,
      [&](std::size_t task) { work(task * blocks / kTasks, (task + 1) * blocks / kTasks, task); },
      tbb::simple_partitioner());
}

}  // namespace

struct ParzenMutualInformation::Probabilities {
  std::size_t rows = 0, columns = 0;  ///< reference and synthetic bins, without the reference's bin of what is outside
  std::vector<double> joint;          ///< [row * columns + column]
  std::vector<double> of_row, of_column;  ///< its sums

  [[nodiscard]] double mutual_information() const {
    double sum = 0;
    for (std::size_t row = 0; row < rows; ++row) {
      for (std::size_t column = 0; column < columns; ++column) {
        const double p = joint[row * columns + column];
        if (p > 0) sum += p * std::log(p / of_column[column] / of_row[row]);
      }
    }
    return sum;
  }
};

Result<ParzenMutualInformation> ParzenMutualInformation::make(const Reference& reference, const Settings& settings) {
  if (auto sound = check(reference); !sound) return sound.error();
  if (settings.reference_bins < 2 || settings.reference_bins > 128 || settings.synthetic_bins < 2 ||
      settings.synthetic_bins > 256 || !(settings.lowest < settings.highest)) {
    return Error{Errc::bad_value,
                 fmt::format("Parzen bins {} x {} over {} to {}: choose 2 to 128, 2 to 256, and a range that rises",
                             settings.reference_bins, settings.synthetic_bins, settings.lowest, settings.highest)};
  }
  return ParzenMutualInformation(
      settings, BinnedPicture(reference.grey, reference.overlap,
                              equal_frequency_bins(reference, settings.reference_bins), settings.reference_bins));
}

double ParzenMutualInformation::cells_per_grey() const {
  return settings_.synthetic_bins / (settings_.highest - settings_.lowest);
}

void ParzenMutualInformation::find_places(const double* grey, Places& places) const {
  const double scale = cells_per_grey(), low = settings_.lowest;
  const double most = std::nextafter(static_cast<double>(settings_.synthetic_bins), 0.0);
  for (std::size_t i = 0; i < kBlock; ++i) {
    const double u = (grey[i] - low) * scale;
    const double least_cut = u > 0 ? u : 0;  // in this order for what is not a number to become 0 too
    const double cut = least_cut < most ? least_cut : most;
    places.cell[i] = static_cast<int>(cut);
    places.part[i] = cut - places.cell[i];
  }
}

ParzenMutualInformation::Probabilities ParzenMutualInformation::probabilities(std::span<const double> synthetic) const {
  assert(synthetic.size() == reference_.size());
  const auto rows = static_cast<std::size_t>(settings_.reference_bins);
  const auto cells = static_cast<std::size_t>(settings_.synthetic_bins);
  const std::size_t all = (rows + 1) * cells;
  const std::span<const std::size_t> blocks = reference_.blocks();
  std::vector<Windows> windows(kTasks * all);
  in_tasks(blocks.size(), [&](std::size_t begin, std::size_t end, std::size_t task) {
    // Two tables, for neighbours are often alike and an addition has to wait for the last one of the same cell.
    std::vector<Windows> odd(all);
    Windows* const tables[2] = {&windows[task * all], odd.data()};
    std::array<double, kBlock> spare{};
    Places place;
    for (const std::size_t first : blocks.subspan(begin, end - begin)) {
      find_places(reference_.block(synthetic, first, spare), place);
      const std::uint8_t* const row = reference_.bins(first);
      for (std::size_t i = 0; i < kBlock; ++i) {
        tables[i % 2][row[i] * cells + static_cast<std::size_t>(place.cell[i])].add(place.part[i]);
      }
    }
    for (std::size_t cell = 0; cell < all; ++cell) windows[task * all + cell].add(odd[cell]);
  });

  Probabilities p;
  p.rows = rows;
  p.columns = cells + 3;
  p.joint.resize(p.rows * p.columns);
  p.of_row.resize(p.rows);
  p.of_column.resize(p.columns);
  const double share = 1 / (6 * static_cast<double>(reference_.pixels()));
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t cell = 0; cell < cells; ++cell) {
      Windows sum;
      for (std::size_t task = 0; task < kTasks; ++task) sum.add(windows[task * all + row * cells + cell]);
      for (std::size_t n = 0; n < 4; ++n) {
        p.joint[row * p.columns + cell + Windows::kBin[n]] += share * sum.sum[n];
      }
    }
    for (std::size_t column = 0; column < p.columns; ++column) {
      p.of_row[row] += p.joint[row * p.columns + column];
      p.of_column[column] += p.joint[row * p.columns + column];
    }
  }
  return p;
}

double ParzenMutualInformation::value(std::span<const double> synthetic) const {
  return probabilities(synthetic).mutual_information();
}

double ParzenMutualInformation::value_and_gradient(std::span<const double> synthetic,
                                                   std::span<double> gradient) const {
  assert(gradient.size() == reference_.size());
  const Probabilities p = probabilities(synthetic);
  // d(value) / d(p(row, column)) is log(p(row, column) / p(column)) but for what does not depend on the column, and the
  // window's derivatives add up to zero over the columns. Where a probability is zero, so are the derivatives.
  const auto cells = static_cast<std::size_t>(settings_.synthetic_bins);
  const double scale = cells_per_grey() / static_cast<double>(reference_.pixels());
  std::vector<Slope> slopes((p.rows + 1) * cells);  // outside the overlap zero
  for (std::size_t row = 0; row < p.rows; ++row) {
    for (std::size_t cell = 0; cell < cells; ++cell) {
      Slope& slope = slopes[row * cells + cell];
      for (std::size_t bin = 0; bin < 4; ++bin) {
        const double joint = p.joint[row * p.columns + cell + bin];
        if (!(joint > 0)) continue;
        const double weight = scale * std::log(joint / p.of_column[cell + bin]);
        slope.a += weight * kSlope[bin][0];
        slope.b += weight * kSlope[bin][1];
        slope.c += weight * kSlope[bin][2];
      }
    }
  }
  const std::span<const std::size_t> blocks = reference_.blocks();
  const auto clear = [&](std::size_t first, std::size_t last) {
    std::fill(gradient.begin() + static_cast<std::ptrdiff_t>(first),
              gradient.begin() + static_cast<std::ptrdiff_t>(last), 0.0);
  };
  clear(0, blocks.front());
  in_tasks(blocks.size(), [&](std::size_t begin, std::size_t end, std::size_t) {
    const double lowest = settings_.lowest, highest = settings_.highest;
    std::array<double, kBlock> spare{};
    Places place;
    for (std::size_t block = begin; block != end; ++block) {
      const std::size_t first = blocks[block], last = std::min(first + kBlock, gradient.size());
      const double* const grey = reference_.block(synthetic, first, spare);
      find_places(grey, place);
      const std::uint8_t* const row = reference_.bins(first);
      for (std::size_t i = 0; i < last - first; ++i) {
        const Slope& slope = slopes[row[i] * cells + static_cast<std::size_t>(place.cell[i])];
        const double f = place.part[i];
        const bool cut = !(grey[i] >= lowest && grey[i] <= highest);
        gradient[first + i] = cut ? 0 : slope.a + f * (slope.b + f * slope.c);
      }
      clear(last, block + 1 < blocks.size() ? blocks[block + 1] : gradient.size());
    }
  });
  return p.mutual_information();
}

}  // namespace birdseye::host
