#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace birdseye::host {

/// From the middle of each frame's exposure to the moment its picture was handed to the screen: the newest some hundred
/// for a chart, and figures over all of them.
class AgeStrip {
 public:
  static constexpr std::size_t kShown = 250;
  static constexpr double kBinMs = 0.5;

  void add(double age_ms);

  /// Oldest first.
  [[nodiscard]] std::vector<float> newest() const;
  [[nodiscard]] std::size_t count() const { return count_; }
  /// Of all, to half a millisecond; 0 without any. part in [0, 1].
  [[nodiscard]] double percentile_ms(double part) const;
  [[nodiscard]] double most_ms() const { return most_ms_; }

 private:
  std::array<float, kShown> ring_{};
  std::array<std::size_t, 4000> bins_{};  ///< up to 2 s; the last holds what is above
  std::size_t count_ = 0;
  double most_ms_ = 0;
};

}  // namespace birdseye::host
