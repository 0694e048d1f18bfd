#include "host/dicom/shared_values.hpp"

#include <algorithm>

namespace birdseye::host {

std::optional<int> SharedValues::with(int had, int number) {
  if (had == 0) return number;
  const auto known = values_.find({had, number});
  if (known != values_.end()) return known->second;
  std::vector<int> both = numbers_of(had);
  if (std::binary_search(both.begin(), both.end(), number)) return values_[{had, number}] = had;
  both.insert(std::upper_bound(both.begin(), both.end(), number), number);
  for (const auto& [value, numbers] : shared_) {
    if (numbers == both) return values_[{had, number}] = value;
  }
  if (next_ > kHighestLabel) return std::nullopt;
  shared_[next_] = both;
  return values_[{had, number}] = next_++;
}

std::vector<int> SharedValues::shared_by(int number) const {
  std::vector<int> values;
  for (const auto& [value, numbers] : shared_) {
    if (std::binary_search(numbers.begin(), numbers.end(), number)) values.push_back(value);
  }
  return values;
}

std::vector<int> SharedValues::numbers_of(int value) const {
  const auto shared = shared_.find(value);
  return shared == shared_.end() ? std::vector<int>{value} : shared->second;
}

}  // namespace birdseye::host
