#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/files/column_names.hpp"

namespace birdseye::host {

inline constexpr auto kTimeColumn = static_cast<std::size_t>(PoseColumn::time);

/// Where in a row each of PoseColumn is, and what its numbers are.
struct PoseColumns {
  std::array<std::optional<std::size_t>, kPoseColumns> at;
  std::size_t count = 0;         ///< of all columns of a row
  std::optional<double> mm_per;  ///< as the header tells
  std::optional<double> s_per;
  std::optional<std::size_t> error;    ///< of the pose, as the program that wrote it tells it, in the unit of lengths
  std::optional<std::size_t> picture;  ///< the name of the one that was taken there
  bool matrix = false;                 ///< rows are 4x4 or 3x4 matrices, after a time, and nothing else
  bool stacked = false;                ///< such a matrix lies in four rows of four numbers, one below another
  [[nodiscard]] bool timed() const { return at[kTimeColumn].has_value(); }
};

/// Columns of a table without a header, by their count.
PoseColumns columns_by_count(std::size_t count);

/// What each column of a header is. A name that is exactly ours goes before others that mean the same.
Result<PoseColumns> columns_by_name(const std::vector<std::string>& header);

}  // namespace birdseye::host
