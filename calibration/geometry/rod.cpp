#include "calibration/geometry/rod.hpp"

#include "calibration/geometry/rotations.hpp"

namespace birdseye {

namespace {

Transform<Camera, Camera> turn_of_picture(const RodScope& scope, double theta_rad) {
  return {rotation_exp(Eigen::Vector3d(0, 0, scope.picture_turn * theta_rad)), Eigen::Vector3d(0, 0, 0)};
}

}  // namespace

Transform<Sensor, Sensor> rod_turn(const RodScope& scope, double theta_rad) {
  const Eigen::Matrix3d turn = rotation_exp(theta_rad * scope.axis_in_sensor);
  return {turn, Eigen::Vector3d(scope.axis_point_in_sensor_mm - turn * scope.axis_point_in_sensor_mm)};
}

Transform<Camera, Sensor> RodScope::camera_from_sensor(double theta_rad) const {
  return turn_of_picture(*this, theta_rad) * camera_from_sensor_at_zero * rod_turn(*this, -theta_rad);
}

Transform<Camera, Sensor> at_zero(const RodScope& scope, const Transform<Camera, Sensor>& camera_from_sensor,
                                  double theta_rad) {
  return turn_of_picture(scope, -theta_rad) * camera_from_sensor * rod_turn(scope, theta_rad);
}

}  // namespace birdseye
