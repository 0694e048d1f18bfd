#include "calibration/hand_eye/tracked_chain.hpp"

#include <cmath>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::calibration {

namespace {

template <typename From>
Transform<Tracker, From> at(const Transform<Tracker, From>& pose, const Motion& motion, double offset_s) {
  Vector6d step;
  step << motion.angular_velocity_rad_s * offset_s, motion.velocity_mm_s * offset_s;
  return moved(pose, step);
}

}  // namespace

ChainResidual chain_residual(const TrackedChain& chain, const Transform<Camera, Marker>& camera_from_marker,
                             const ChainState& state) {
  const auto measured = at(chain.tracker_from_sensor, chain.sensor_motion, state.time_offset_s);
  const auto body = at(chain.tracker_from_body, chain.body_motion, state.time_offset_s);
  const Transform<Camera, Marker> seen(camera_from_marker.rotation(),
                                       Eigen::Vector3d(state.board_scale * camera_from_marker.translation()));
  const auto tracker_from_camera = body * state.body_from_marker * seen.inverse();
  const auto predicted = tracker_from_camera * state.camera_from_sensor;

  ChainResidual out;
  const Eigen::Vector3d turn = rotation_log(predicted.rotation() * measured.rotation().transpose());
  out.value << turn, predicted.translation() - measured.translation();

  const Eigen::Matrix3d& k = tracker_from_camera.rotation();
  const Eigen::Vector3d sensor_from_board_mm = state.camera_from_sensor.translation() - seen.translation();
  const Eigen::Vector3d sensor_in_marker_mm = seen.rotation().transpose() * sensor_from_board_mm;
  const Eigen::Matrix3d& b = body.rotation();
  const Eigen::Matrix3d log_step = inverse_left_jacobian(turn);
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  out.by_hand_eye << log_step * k, zero, zero, k;
  out.by_body_from_marker << log_step * b, zero,  //
      -b * cross_matrix(state.body_from_marker.rotation() * sensor_in_marker_mm), b;
  out.by_camera_from_marker << -log_step * k, zero,  //
      k * cross_matrix(sensor_from_board_mm), -state.board_scale * k;
  out.by_board_scale << Eigen::Vector3d::Zero(), -k * camera_from_marker.translation();
  const Eigen::Vector3d& body_turn = chain.body_motion.angular_velocity_rad_s;
  // The measured turn enters on the other side of the logarithm: its left Jacobian there is that of minus the turn.
  out.by_time_offset << log_step * body_turn -
                            inverse_left_jacobian(Eigen::Vector3d(-turn)) * chain.sensor_motion.angular_velocity_rad_s,
      chain.body_motion.velocity_mm_s + body_turn.cross(predicted.translation() - body.translation()) -
          chain.sensor_motion.velocity_mm_s;
  return out;
}

Transform<Camera, Marker> tracked_view(const TrackedChain& chain, const ChainState& state) {
  return state.camera_from_sensor * at(chain.tracker_from_sensor, chain.sensor_motion, state.time_offset_s).inverse() *
         at(chain.tracker_from_body, chain.body_motion, state.time_offset_s) * state.body_from_marker;
}

Matrix6d position_noise_shape(const TrackedChain& chain) {
  Matrix6d out = Matrix6d::Zero();
  out.bottomRightCorner<3, 3>().diagonal().setConstant(chain.body_tracked ? 2 : 1);
  return out;
}

Matrix6d angle_noise_shape(const TrackedChain& chain) {
  Matrix6d out = Matrix6d::Zero();
  out.topLeftCorner<3, 3>().setIdentity();
  if (!chain.body_tracked) return out;
  // A turn n of the board moves the sensor, as seen through it, by n x arm = -[arm] n.
  Eigen::Matrix<double, 6, 3> by_turn;
  by_turn << Eigen::Matrix3d::Identity(),
      -cross_matrix(chain.tracker_from_sensor.translation() - chain.tracker_from_body.translation());
  return out + by_turn * by_turn.transpose();
}

Matrix6d chain_covariance(const TrackedChain& chain, const TrackerNoise& noise) {
  return noise.position_sigma_mm * noise.position_sigma_mm * position_noise_shape(chain) +
         noise.angle_sigma_rad * noise.angle_sigma_rad * angle_noise_shape(chain);
}

}  // namespace birdseye::calibration
