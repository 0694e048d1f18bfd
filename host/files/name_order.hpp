#pragma once

#include <string>
#include <string_view>

namespace birdseye::host {

inline bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// The order of names in which pictures and poses pair. Runs of digits compare by value (pose.2 before pose.10), the
/// rest by letters; of names that are equal in this, the one with fewer leading zeros comes first.
inline bool before_by_number(const std::string& a, const std::string& b) {
  std::size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (!is_digit(a[i]) || !is_digit(b[k])) {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i, ++k;
      continue;
    }
    const auto run = [](const std::string& text, std::size_t& at) {
      while (at < text.size() && text[at] == '0') ++at;
      const std::size_t from = at;
      while (at < text.size() && is_digit(text[at])) ++at;
      return std::string_view(text).substr(from, at - from);
    };
    const std::string_view x = run(a, i), y = run(b, k);
    if (x.size() != y.size()) return x.size() < y.size();
    if (x != y) return x < y;
  }
  const std::size_t left_a = a.size() - i, left_b = b.size() - k;
  if (left_a != left_b) return left_a < left_b;
  return a.size() != b.size() ? a.size() < b.size() : a < b;
}

}  // namespace birdseye::host
