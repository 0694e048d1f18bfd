#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

namespace birdseye::calibration {

/// Whether two sets of corresponding points are of one handedness.
enum class Handedness {
  same,
  mirrored,    ///< one of the two is the other's mirror image
  cannot_tell  ///< the points are so nearly flat, for how well they are localised, that both fit alike
};

/// How the shapes of two sets of corresponding points compare.
struct PointShape {
  Handedness handedness = Handedness::same;
  /// Root mean square residuals of the fits with a scale, of `from` as it is and of its mirror image.
  double fre_rms_mm = 0, mirrored_fre_rms_mm = 0;
  /// How many times likelier the residuals are where one set is mirrored than where none is.
  double mirrored_odds = 1;
  /// Lengths of `to` over those of `from`, of the handedness that fits better; one standard deviation of it, of which
  /// 0.2 % are what a sound CT and a sound tracker may differ by; and the probability that chance alone makes a scale
  /// that far from 1.
  double scale = 1, scale_sigma = 0, scale_chance = 1;
  /// The same along one axis of `to` alone, as a CT has whose slices lie further apart than its file says: of the axis
  /// (0 is x) that explains most, of those along which the points spread by 10 mm. The chance counts that three axes
  /// were tried.
  int axis = 0;
  double axis_scale = 1, axis_scale_sigma = 0, axis_scale_chance = 1;
};

/// Fits `to` by `from` with turn, shift and scale, with and without a reflection (S. Umeyama, 1991). The sets are said
/// to be of the same handedness, or mirrored, where the likelihoods (of the residuals' variance, or of the localisation
/// error where it is given) are apart by a factor of 100. The scale's chance is from an F test (a chi-square test where
/// the localisation error is given). Three points are always flat.
/// Requires what fit_points accepts.
PointShape compare_shapes(std::span<const Eigen::Vector3d> to_mm, std::span<const Eigen::Vector3d> from_mm,
                          std::optional<double> localisation_rms_mm = std::nullopt);

}  // namespace birdseye::calibration
