#pragma once

#include <Eigen/Core>
#include <optional>

namespace birdseye::host {

/// Errors that all views share: a shift, a turn and a scale, as seven independent ones of a standard deviation of 1.
inline constexpr int kCommonErrors = 7;
using ByCommonErrors = Eigen::Matrix<double, 3, kCommonErrors>;  ///< how they move a place, mm
using CommonErrors = Eigen::Matrix<double, kCommonErrors, 1>;

/// How errors of the views' lenses, each independent and of a standard deviation of 1, move a place, mm: as many
/// columns as there are such errors, and none where nothing is known of them.
using ByLensErrors = Eigen::Matrix3Xd;

/// What a standard deviation may be of a place that is given from outside: smaller ones contradict one another where a
/// place is given twice, and beyond the larger a place tells nothing of an organ.
inline constexpr double kLeastGivenSigma_mm = 0.01, kMostGivenSigma_mm = 100;

/// A place that is on the organ's surface now, patient mm, known along the surface's normal.
struct SeenPoint {
  Eigen::Vector3d place_mm;
  double sigma_mm = 0;  ///< of what is independent of its neighbours'
  /// From the camera that sees it, of unit length: the surface there faces it. None for a point of an outline.
  std::optional<Eigen::Vector3d> from_camera;
  /// Of one axis of a shift that all places with one have wrong together, each in proportion; 0: none of it.
  double shift_mm = 0;
  double broad_mm = 0;  ///< a standard deviation of what places within some 25 mm have wrong together; 0: nothing
  ByCommonErrors by_common_mm = ByCommonErrors::Zero();  ///< of a place that views tell of, where these errors count
  ByLensErrors by_lens_mm = ByLensErrors(3, 0);          ///< likewise
};

}  // namespace birdseye::host
