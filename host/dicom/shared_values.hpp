#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace birdseye::host {

/// The highest value of a voxel of labels.
inline constexpr int kHighestLabel = 32767;

/// Gives voxels that belong to several structures values of their own, after the highest number of a structure.
class SharedValues {
 public:
  explicit SharedValues(int highest_number) : next_(highest_number + 1) {}

  /// The value of a voxel that had `had` (0: of none) and is of a further structure; empty where there are too many.
  std::optional<int> with(int had, int number);
  /// The values of voxels of this structure beside its number.
  [[nodiscard]] std::vector<int> shared_by(int number) const;

 private:
  [[nodiscard]] std::vector<int> numbers_of(int value) const;

  int next_;
  std::map<std::pair<int, int>, int> values_;
  std::map<int, std::vector<int>> shared_;
};

}  // namespace birdseye::host
