#include "calibration/guide/scope_move.hpp"

#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

// Less than this nobody does by eye.
constexpr double kLeastTilt_rad = 6 * kRadPerDeg, kLeastTurn_rad = 12 * kRadPerDeg;
constexpr double kLeastShare = 0.1;       // of the distance
constexpr double kLeastOffCentre = 0.08;  // of the picture's size

const Eigen::Matrix3d kTurnedOver = Eigen::Vector3d(1, -1, -1).asDiagonal();

/// A rotation as a tilt of the z axis, by the shortest way, after a turn about it.
struct TiltAndTurn {
  Eigen::Vector3d axis;  ///< where z comes to lie
  double turn_rad;       ///< about z, x to y
};
TiltAndTurn tilt_and_turn(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d axis = rotation.col(2);
  const Eigen::Matrix3d tilt = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis).toRotationMatrix();
  const Eigen::Matrix3d turn = tilt.transpose() * rotation;
  return {axis, std::atan2(turn(1, 0), turn(0, 0))};
}

double tilt_of(const Eigen::Vector3d& axis) {
  return std::atan2(axis.head<2>().norm(), axis.z());
}

/// Of a vector in the picture, y down.
PictureWay way_of(double x, double y) {
  return static_cast<PictureWay>((std::lround(std::atan2(y, x) / (45 * kRadPerDeg)) + 8) % 8);
}

BoardPlace place_of(const CameraModel& camera, const Eigen::Vector2d& pixel) {
  const double x = pixel.x() / camera.width_px - 0.5, y = pixel.y() / camera.height_px - 0.5;
  const auto third = [](double part) { return part < -kLeastOffCentre ? 0 : part > kLeastOffCentre ? 2 : 1; };
  return static_cast<BoardPlace>(3 * third(y) + third(x));
}

}  // namespace

ScopeView scope_view(const Transform<Camera, Marker>& camera_from_marker) {
  const Transform<Marker, Camera> marker_from_camera = camera_from_marker.inverse();
  ScopeView view;
  view.from_behind = marker_from_camera.rotation()(2, 2) < 0;
  const Eigen::Matrix3d rotation =
      view.from_behind ? kTurnedOver * marker_from_camera.rotation() : marker_from_camera.rotation();
  const auto [axis, turn_rad] = tilt_and_turn(rotation);
  view.tilt_rad = tilt_of(axis);
  view.direction_rad = std::atan2(axis.y(), axis.x());
  view.turn_rad = turn_rad;
  view.distance_mm = std::abs(marker_from_camera.translation().z()) / std::max(axis.z(), 1e-6);
  return view;
}

Transform<Camera, Marker> pose_of(const ScopeView& view, const Eigen::Vector3d& centre_mm,
                                  const Eigen::Vector2d& centre_tangent) {
  const Eigen::Vector3d tilt_axis(-std::sin(view.direction_rad), std::cos(view.direction_rad), 0);
  const Eigen::Matrix3d upright =
      rotation_exp(view.tilt_rad * tilt_axis) * rotation_exp(view.turn_rad * Eigen::Vector3d::UnitZ());
  const Eigen::Matrix3d rotation = (view.from_behind ? kTurnedOver * upright : upright).transpose();
  const Eigen::Vector3d centre_in_camera = view.distance_mm * centre_tangent.homogeneous();
  return {rotation, Eigen::Vector3d(centre_in_camera - rotation * centre_mm)};
}

ScopeMove move_between(const Transform<Camera, Marker>& now, const Transform<Camera, Marker>& next,
                       const CameraModel& camera, const Eigen::Vector3d& centre_mm) {
  ScopeMove move;
  // The next camera's axes as the camera has them now.
  const auto [axis, turn_rad] = tilt_and_turn(now.rotation() * next.rotation().transpose());
  if (tilt_of(axis) > kLeastTilt_rad) {
    // The tip points along the axis, so that the camera head lies the other way.
    move.tilt = {tilt_of(axis), way_of(-axis.x(), -axis.y())};
  }
  if (std::abs(turn_rad) > kLeastTurn_rad) move.turn_rad = turn_rad;
  const double from_mm = (now * centre_mm).z(), to_mm = (next * centre_mm).z();
  if (std::abs(to_mm - from_mm) > kLeastShare * from_mm) move.nearer_mm = from_mm - to_mm;
  const auto from_px = project(camera, now * centre_mm), to_px = project(camera, next * centre_mm);
  const Eigen::Vector2d size_px(camera.width_px, camera.height_px);
  if (to_px && (!from_px || (*to_px - *from_px).cwiseQuotient(size_px).norm() > kLeastOffCentre))
    move.board = place_of(camera, *to_px);
  return move;
}

}  // namespace birdseye::calibration
