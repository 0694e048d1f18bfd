#pragma once

#include "host/registration/similarity/binned_picture.hpp"
#include "host/registration/similarity/similarity.hpp"

namespace birdseye::host {

/// Mutual information that can be differentiated: the reference in zero-order bins of equal frequency, the synthetic
/// picture through a cubic B-spline window of one bin's scale (Mattes et al., IEEE TMI 22(1), 2003, without sampling).
/// Equation 4 of the paper on those probabilities, nats. Safe to ask from several threads; the same to the bit for any
/// number of them.
class ParzenMutualInformation {
 public:
  struct Settings {
    int reference_bins = 32;  ///< 2 to 128
    int synthetic_bins = 32;  ///< 2 to 256, over lowest to highest; the window adds three beyond them
    /// Synthetic greys are cut to this range. It reaches below black, so that a renderer's background can have a value
    /// of its own.
    double lowest = -0.25, highest = 1;
  };

  /// The reference is prepared here and not kept. Refuses what check() refuses, and settings out of range.
  static Result<ParzenMutualInformation> make(const Reference& reference, const Settings& settings);
  static Result<ParzenMutualInformation> make(const Reference& reference) { return make(reference, {}); }

  /// synthetic: grey of each pixel, of the reference's size.
  [[nodiscard]] double value(std::span<const double> synthetic) const;
  /// gradient: of the same size; d(value) / d(grey), zero outside the overlap and where the grey is cut.
  [[nodiscard]] double value_and_gradient(std::span<const double> synthetic, std::span<double> gradient) const;

 private:
  /// For the greys of a block: the cells between neighbouring bins in which they lie, and how far into the cells.
  struct Places {
    std::array<int, BinnedPicture::kBlock> cell;
    std::array<double, BinnedPicture::kBlock> part;  ///< 0 to 1
  };
  struct Probabilities;

  ParzenMutualInformation(const Settings& settings, BinnedPicture reference)
      : settings_(settings), reference_(std::move(reference)) {}
  [[nodiscard]] double cells_per_grey() const;
  void find_places(const double* grey, Places& places) const;
  [[nodiscard]] Probabilities probabilities(std::span<const double> synthetic) const;

  Settings settings_;
  BinnedPicture reference_;
};

}  // namespace birdseye::host
