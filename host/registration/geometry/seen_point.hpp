#pragma once

#include <Eigen/Core>
#include <optional>

namespace birdseye::host {

/// A place that is on the organ's surface now, patient mm, known along the surface's normal.
struct SeenPoint {
  Eigen::Vector3d place_mm;
  double sigma_mm = 0;  ///< of what is independent of its neighbours'
  /// From the camera that sees it, of unit length: the surface there faces it. None for a point of an outline.
  std::optional<Eigen::Vector3d> from_camera;
  /// Of one axis of a shift that all places with one have wrong together, each in proportion; 0: none of it.
  double shift_mm = 0;
};

}  // namespace birdseye::host
