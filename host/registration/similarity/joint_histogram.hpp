#pragma once

#include <vector>

#include "host/registration/similarity/binned_picture.hpp"

namespace birdseye::host {

/// Counts pairs of grey levels of a reference and of synthetic pictures, over an overlap, in bins of equal width.
class JointHistogram {
 public:
  /// Entropies, nats.
  struct Entropies {
    double reference = 0, synthetic = 0, joint = 0;
    [[nodiscard]] double mutual_information() const { return reference + synthetic - joint; }
  };

  /// reference, overlap: of one size, the overlap not empty. bins: 2 to 128.
  JointHistogram(std::span<const std::uint8_t> reference, std::span<const std::uint8_t> overlap, int bins);

  /// Counts of the pixels in the overlap, at [bin of the reference * bins + bin of the synthetic picture].
  [[nodiscard]] std::vector<std::uint32_t> count(std::span<const std::uint8_t> synthetic) const;
  [[nodiscard]] Entropies entropies(std::span<const std::uint8_t> synthetic) const;

 private:
  std::size_t bins_;
  BinnedPicture reference_;
};

}  // namespace birdseye::host
