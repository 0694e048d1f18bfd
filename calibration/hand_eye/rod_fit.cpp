#include "calibration/hand_eye/rod_fit.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

constexpr double kLeastApart_rad = 20 * kRadPerDeg;  // a nearer pair multiplies hand-eye's own error by three and more

/// What is left of a station when the picture is turned back: camera_from_sensor_at_zero Rot(axis, -theta).
Transform<Camera, Sensor> turned_back(const RodStation& s, double picture_turn) {
  const Transform<Camera, Camera> back(rotation_exp(Eigen::Vector3d(0, 0, -picture_turn * s.theta_rad)),
                                       Eigen::Vector3d(0, 0, 0));
  return back * s.camera_from_sensor;
}

/// The middle of rotations and places of the camera in the sensor's frame.
Transform<Camera, Sensor> mean_of(const std::vector<Transform<Camera, Sensor>>& all) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d camera_in_sensor_mm = Eigen::Vector3d::Zero();
  for (const auto& t : all) {
    sum += t.rotation();
    camera_in_sensor_mm += t.inverse().translation() / static_cast<double>(all.size());
  }
  const Eigen::Matrix3d rotation = nearest_rotation(sum);
  return {rotation, Eigen::Vector3d(-(rotation * camera_in_sensor_mm))};
}

RodFit fit_with(std::span<const RodStation> stations, double picture_turn) {
  RodFit out;
  out.scope.picture_turn = picture_turn;
  Eigen::Vector3d axis = Eigen::Vector3d::Zero();
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const RodStation& a : stations) {
    for (const RodStation& b : stations) {
      // Angles near half a turn have an axis of either sign; pairs in between say the same.
      const double apart_rad = std::remainder(a.theta_rad - b.theta_rad, 2 * std::numbers::pi);
      if (!(apart_rad >= kLeastApart_rad)) continue;
      const auto screw = turned_back(a, picture_turn).inverse() * turned_back(b, picture_turn);
      const Eigen::Vector3d turn = rotation_log(screw.rotation());
      const bool same_way = axis.isZero() || turn.dot(axis) > 0 || apart_rad < 0.9 * std::numbers::pi;
      axis += (same_way ? 1.0 : -1.0) * turn;
      const Eigen::Matrix3d moved = Eigen::Matrix3d::Identity() - screw.rotation();
      normal += moved.transpose() * moved;
      right += moved.transpose() * screw.translation();
    }
  }
  out.scope.axis_in_sensor = axis.normalized();
  // Along the axis the point is free: nearest to the sensor's origin.
  normal += normal.trace() * out.scope.axis_in_sensor * out.scope.axis_in_sensor.transpose();
  out.scope.axis_point_in_sensor_mm = solve_symmetric(normal, right);
  std::vector<Transform<Camera, Sensor>> zeros;
  for (const RodStation& s : stations) zeros.push_back(at_zero(out.scope, s.camera_from_sensor, s.theta_rad));
  out.scope.camera_from_sensor_at_zero = mean_of(zeros);
  const auto n = static_cast<double>(stations.size());
  for (const RodStation& s : stations) {
    const auto model = out.scope.camera_from_sensor(s.theta_rad);
    const double turn = rotation_angle_between(model.rotation(), s.camera_from_sensor.rotation()) * kDegPerRad;
    const Eigen::Vector3d shift_mm = model.inverse().translation() - s.camera_from_sensor.inverse().translation();
    out.turn_rms_deg += turn * turn / n;
    out.shift_rms_mm += shift_mm.squaredNorm() / n;
  }
  out.turn_rms_deg = std::sqrt(out.turn_rms_deg);
  out.shift_rms_mm = std::sqrt(out.shift_rms_mm);
  return out;
}

}  // namespace

Result<RodFit> fit_rod(std::span<const RodStation> stations) {
  double farthest_rad = 0;
  for (const RodStation& a : stations) {
    if (!std::isfinite(a.theta_rad) || !a.camera_from_sensor.matrix().allFinite())
      return Error{Errc::bad_value, "rod: an angle or a hand-eye transform is not a finite number"};
    for (const RodStation& b : stations)
      farthest_rad = std::max(farthest_rad, std::abs(std::remainder(a.theta_rad - b.theta_rad, 2 * std::numbers::pi)));
  }
  if (farthest_rad < kLeastApart_rad) {
    return Error{Errc::degenerate,
                 "rod: calibrate hand-eye at two angles of the rod or more, at least 20 degrees apart"};
  }
  RodFit best = fit_with(stations, 1);
  for (const double picture_turn : {0.0, -1.0}) {
    const RodFit other = fit_with(stations, picture_turn);
    if (other.turn_rms_deg < best.turn_rms_deg) best = other;
  }
  return best;
}

}  // namespace birdseye::calibration
