#pragma once

#include <Eigen/Core>

#include "calibration/geometry/linear_algebra.hpp"
#include "calibration/geometry/rotations.hpp"
#include "calibration/geometry/transform.hpp"

namespace birdseye::calibration {

/// How a tracked body moved while its pose was taken, in the tracker's frame.
struct Motion {
  Eigen::Vector3d velocity_mm_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular_velocity_rad_s = Eigen::Vector3d::Zero();
};

/// One standard deviation per axis of one tracked pose: of its position in the tracker's frame, and of the small
/// rotation vector by which its orientation is off.
struct TrackerNoise {
  double position_sigma_mm = 0;
  double angle_sigma_rad = 0;
};

/// What the tracker measured at one station.
struct TrackedChain {
  Transform<Tracker, Sensor> tracker_from_sensor;
  Transform<Tracker, TrackedBody> tracker_from_body;  ///< the identity, without noise, for a board at rest
  Motion sensor_motion, body_motion;
  bool body_tracked = false;
};

/// What is the same at all stations.
struct ChainState {
  Transform<Camera, Sensor> camera_from_sensor;
  Transform<TrackedBody, Marker> body_from_marker;
  double time_offset_s = 0;  ///< a picture of time t shows the tracker's pose at t + time_offset_s
  double board_scale = 1;    ///< of the camera's distances: the true size of the board over its stated size
};

/// The tracked pose of the sensor, predicted through the picture, against the measured one.
/// All vectors are of rotation (rad), then translation (mm); a pose changes as R <- exp(rotation) R, t <- t +
/// translation.
struct ChainResidual {
  Vector6d value;  ///< predicted less measured, in the tracker's frame
  Matrix6d by_hand_eye, by_body_from_marker, by_camera_from_marker;
  Vector6d by_time_offset, by_board_scale;
};

/// tracker_from_body * body_from_marker * camera_from_marker^-1 * camera_from_sensor, against tracker_from_sensor.
ChainResidual chain_residual(const TrackedChain& chain, const Transform<Camera, Marker>& camera_from_marker,
                             const ChainState& state);

/// The board's pose in the camera as the tracker alone has it.
Transform<Camera, Marker> tracked_view(const TrackedChain& chain, const ChainState& state);

/// The covariance of a residual by the noise of the tracked poses, per unit of variance (mm^2, rad^2): the noise turns
/// a tracked board about its own origin, so that what is seen from afar also moves.
Matrix6d position_noise_shape(const TrackedChain& chain);
Matrix6d angle_noise_shape(const TrackedChain& chain);
Matrix6d chain_covariance(const TrackedChain& chain, const TrackerNoise& noise);

template <typename To, typename From>
Transform<To, From> moved(const Transform<To, From>& pose, const Vector6d& step) {
  return {Eigen::Matrix3d(rotation_exp(step.head<3>()) * pose.rotation()),
          Eigen::Vector3d(pose.translation() + step.tail<3>())};
}

}  // namespace birdseye::calibration
