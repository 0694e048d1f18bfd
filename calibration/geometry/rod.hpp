#pragma once

#include "calibration/geometry/transform.hpp"

namespace birdseye {

/// How an oblique scope's camera moves when its rod is turned in the camera head, to which the sensor is fixed.
///
/// The oblique lens at the tip goes round the rod's axis, while the chip in the head stays: so the picture turns back
/// about its principal point. With the rod turned by theta from where camera_from_sensor_at_zero was found,
///   camera_from_sensor(theta) = Rot(z, picture_turn theta) camera_from_sensor_at_zero Rot(axis, -theta).
/// Turning the rod of a straight scope, whose axis is the camera's, changes nothing: picture_turn is 1 there. It is 0
/// where the chip turns with the rod. The picture turns about the principal point only if pixels are square there.
/// Source: T. Yamaguchi et al., "Development of a camera model and calibration procedure for oblique-viewing
/// endoscopes", Computer Aided Surgery 9(5), 2004; C. Wu, B. Jaramaz, S. Narasimhan, IJCARS, 2010.
struct RodScope {
  Transform<Camera, Sensor> camera_from_sensor_at_zero;
  Eigen::Vector3d axis_in_sensor{0, 0, 1};  ///< of unit length; theta turns right-handed about it
  Eigen::Vector3d axis_point_in_sensor_mm = Eigen::Vector3d::Zero();  ///< any point of the axis
  double picture_turn = 1;

  [[nodiscard]] Transform<Camera, Sensor> camera_from_sensor(double theta_rad) const;
};

/// The turn of the rod itself: of points of the sensor's frame about the axis.
Transform<Sensor, Sensor> rod_turn(const RodScope& scope, double theta_rad);

/// The inverse of camera_from_sensor(theta): brings a hand-eye that was found with the rod at theta back to zero. Does
/// not read scope.camera_from_sensor_at_zero.
Transform<Camera, Sensor> at_zero(const RodScope& scope, const Transform<Camera, Sensor>& camera_from_sensor,
                                  double theta_rad);

}  // namespace birdseye
