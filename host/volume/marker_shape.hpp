#pragma once

#include <Eigen/Core>

#include "calibration/base/result.hpp"

namespace birdseye::host {

/// post: an air cavity in a thin wall, on a stalk (post_finder.hpp). The others are solid.
enum class MarkerKind { ball, ring, cylinder, post };
const char* name_of(MarkerKind kind);

/// What a fiducial marker looks like in a CT: brighter than what is round it, of one density. Of a post the ball that
/// it fits in.
struct MarkerShape {
  MarkerKind kind = MarkerKind::ball;
  double diameter_mm = 8;  ///< from outside to outside; of a post 0: any
  double hole_mm = 0;      ///< ring and cylinder: of the hole
  double height_mm = 0;    ///< cylinder: along its axis

  /// How far a point lies outside of the marker's surface (inside: negative). The marker's centre is the origin.
  [[nodiscard]] double outside_mm(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& axis) const;
  /// Half of the marker's extent along a direction.
  [[nodiscard]] double half_extent_mm(const Eigen::Vector3d& direction, const Eigen::Vector3d& axis) const;
  [[nodiscard]] double volume_mm3() const;
  [[nodiscard]] double thinnest_mm() const;  ///< the least of its outer dimensions
  [[nodiscard]] double widest_mm() const;    ///< and the largest
};

/// Refuses sizes no marker has: a hole as wide as the whole, no height, beyond 100 mm.
Result<void> check(const MarkerShape& shape);

}  // namespace birdseye::host
