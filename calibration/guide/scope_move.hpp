#pragma once

#include <optional>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// How a scope looks at a board, apart from where in the picture the board lies.
struct ScopeView {
  double tilt_rad = 0;       ///< the scope's axis against the board's normal
  double direction_rad = 0;  ///< where its tip points over the board: from the board's x axis to its y axis
  double turn_rad = 0;     ///< about its own axis, from x to y, after the tilt; 0: the board's x axis runs to the right
  double distance_mm = 0;  ///< to the board's plane, along the axis
  bool from_behind = false;  ///< the board's z axis points to the camera and not away from it
};
ScopeView scope_view(const Transform<Camera, Marker>& camera_from_marker);

/// The inverse: the pose that gives this view and shows the board's point `centre_mm` at `centre_tangent` (x / z, y / z
/// in the camera frame), at the view's distance along the axis.
Transform<Camera, Marker> pose_of(const ScopeView& view, const Eigen::Vector3d& centre_mm,
                                  const Eigen::Vector2d& centre_tangent);

/// Ways in the picture as it is now, clockwise.
enum class PictureWay { right, down_right, down, down_left, left, up_left, up, up_right };
/// Parts of the picture, row by row.
enum class BoardPlace { upper_left, upper, upper_right, left, middle, right, lower_left, lower, lower_right };

/// What to do with the scope to come from one pose to the other, for the person who holds it; a part that is absent is
/// too little to be done by eye. Ways and places are those of the picture as it is now.
struct ScopeMove {
  /// To tilt the scope to the left is to lean its long axis so that the camera head goes to the picture's left while
  /// the tip keeps pointing at the board: the board's left side comes nearer.
  struct Tilt {
    double by_rad;
    PictureWay way;
  };
  std::optional<Tilt> tilt;
  std::optional<double> turn_rad;   ///< about its long axis, clockwise as seen along the scope from behind
  std::optional<double> nearer_mm;  ///< negative: draw back
  std::optional<BoardPlace> board;  ///< bring it there
};
/// centre_mm: the board's middle, frame Marker.
ScopeMove move_between(const Transform<Camera, Marker>& now, const Transform<Camera, Marker>& next,
                       const CameraModel& camera, const Eigen::Vector3d& centre_mm);

}  // namespace birdseye::calibration
