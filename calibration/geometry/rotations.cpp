#include "calibration/geometry/rotations.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>

namespace birdseye {

namespace {

// Below this angle the closed forms lose their digits to cancellation, and their series are exact to rounding.
constexpr double kSmall_rad = 1e-3;

}  // namespace

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d out;
  out << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return out;
}

Eigen::Matrix3d rotation_exp(const Eigen::Vector3d& rotation_vector_rad) {
  const double angle = rotation_vector_rad.norm();
  if (angle < 1e-300) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation_vector_rad / angle).toRotationMatrix();
}

Eigen::Vector3d rotation_log(const Eigen::Matrix3d& rotation) {
  // By way of the quaternion: well-conditioned at 0 and at pi, where the trace formula is not.
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  if (sine < 1e-300) return Eigen::Vector3d::Zero();
  return q.vec() * (2.0 * std::atan2(sine, q.w()) / sine);
}

double rotation_angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return rotation_log(a.transpose() * b).norm();
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w) {
  const double angle2 = w.squaredNorm(), angle = std::sqrt(angle2);
  const bool small = angle < kSmall_rad;
  const double first = small ? 0.5 - angle2 / 24 : (1 - std::cos(angle)) / angle2;
  const double second = small ? 1.0 / 6 - angle2 / 120 : (angle - std::sin(angle)) / (angle2 * angle);
  const Eigen::Matrix3d x = cross_matrix(w);
  return Eigen::Matrix3d::Identity() + first * x + second * x * x;
}

Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w) {
  return left_jacobian(-w);
}

Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& w) {
  const double angle = w.norm();
  const Eigen::Matrix3d x = cross_matrix(w);
  const double second = angle < kSmall_rad
                            ? 1.0 / 12 + angle * angle / 720
                            : 1 / (angle * angle) - (1 + std::cos(angle)) / (2 * angle * std::sin(angle));
  return Eigen::Matrix3d::Identity() - 0.5 * x + second * x * x;
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix, double* likeness) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handed = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Vector3d& s = svd.singularValues();
  if (likeness != nullptr) *likeness = s[0] + s[1] + handed * s[2];
  return svd.matrixU() * Eigen::Vector3d(1, 1, handed).asDiagonal() * svd.matrixV().transpose();
}

}  // namespace birdseye
