#pragma once

#include <Eigen/Core>

namespace birdseye {

/// The matrix of a cross product: cross_matrix(v) * w = v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Rotation vector (axis * angle, rad) -> rotation matrix.
Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& rotation_vector_rad);
/// Rotation matrix -> rotation vector, angle in [0, pi].
Eigen::Vector3d rotation_log(const Eigen::Matrix3d& rotation);
/// The angle between two rotations, rad, in [0, pi].
double rotation_angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b);

/// The left Jacobian of SO(3): exp(w + d) = exp(left_jacobian(w) d) exp(w) to first order in d (T. Barfoot, State
/// Estimation for Robotics, 2017, eq. 7.77b).
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& rotation_vector_rad);
/// The right one: exp(w + d) = exp(w) exp(right_jacobian(w) d) to first order in d.
Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& rotation_vector_rad);
/// log(exp(d) exp(w)) = w + inverse_left_jacobian(w) d to first order in d; |w| < 2 pi.
Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& rotation_vector_rad);

/// The rotation nearest to a matrix by the sum of squared differences: of a sum of rotations, their mean; of
/// sum(a_i b_i^T), the one that turns the b_i to the a_i best (Kabsch). If likeness is given, it gets
/// trace(rotation^T matrix), the sum of a_i . rotation b_i.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix, double* likeness = nullptr);

}  // namespace birdseye
