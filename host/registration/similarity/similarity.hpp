#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// The video picture that synthetic ones are compared with, and where.
struct Reference {
  int width_px = 0, height_px = 0;
  std::span<const std::uint8_t> grey;     ///< rows from the top
  std::span<const std::uint8_t> overlap;  ///< of the same size, not zero where pixels count
};

/// Errc::bad_value for spans of another size; Errc::degenerate for an overlap of nothing, or of one grey level.
Result<void> check(const Reference& reference);

/// How alike a synthetic picture and the reference are; larger is more alike. Safe to ask from several threads; the
/// same to the bit for any number of them.
class Similarity {
 public:
  virtual ~Similarity() = default;
  /// synthetic: 8 bit grey, of the reference's size. A constant one is worth 0 (normalised mutual information: 1).
  [[nodiscard]] virtual double value(std::span<const std::uint8_t> synthetic) const = 0;
};

/// "mi", "nmi", "ncc", "gradient".
const std::vector<std::string>& similarity_names();

/// - mi: mutual information of the grey levels in bins x bins equal bins, nats (equation 4 of the paper);
/// - nmi: (H(a) + H(b)) / H(a, b) of the same histogram, 1 to 2 (Studholme et al., Pattern Recognition 32, 1999);
/// - ncc: normalised correlation, -1 to 1;
/// - gradient: the mean of the normalised correlations of the x and y Sobel gradients, -1 to 1 (Penney et al., IEEE TMI
///   17(4), 1998), over those pixels of the overlap whose neighbours are all in it.
/// The reference is prepared here and not kept. Refuses what check() refuses, an unknown name, bins outside 2 to 128,
/// and (Errc::degenerate) a reference that is constant to the measure.
Result<std::unique_ptr<Similarity>> make_similarity(const std::string& name, const Reference& reference, int bins = 64);

}  // namespace birdseye::host
