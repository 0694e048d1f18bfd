#include "host/registration/geometry/common_pose_error.hpp"

#include <Eigen/Cholesky>
#include <utility>

#include "calibration/geometry/rotations.hpp"

namespace birdseye::host {

Eigen::Matrix<double, 3, kCommonErrors> moves_by(const Eigen::Vector3d& from_middle_mm) {
  Eigen::Matrix<double, 3, kCommonErrors> out;
  out << Eigen::Matrix3d::Identity(), -cross_matrix(from_middle_mm), from_middle_mm;
  return out;
}

CommonPoseError::CommonPoseError(Eigen::Vector3d about_mm, const Covariance& motion)
    : about_mm_(std::move(about_mm)), factor_(motion.llt().matrixL()) {}

ByCommonErrors CommonPoseError::at(const Eigen::Vector3d& place_mm) const {
  return moves_by(place_mm - about_mm_) * factor_;
}

Transform<Camera, Patient> CommonPoseError::without(const CommonErrors& errors, const PinholeView& view) const {
  const CommonErrors motion = factor_ * errors;
  const Eigen::Vector3d eye_mm = view.eye_in_patient_mm - at(view.eye_in_patient_mm) * errors;
  const Eigen::Matrix3d rotation = view.camera_from_patient.rotation() * rotation_exp(motion.segment<3>(3));
  return {rotation, Eigen::Vector3d(-(rotation * eye_mm))};
}

}  // namespace birdseye::host
