#include "host/window/orbit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace birdseye::host {

Transform<Camera, Patient> orbited(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient,
                                   const Eigen::Vector3d& about_in_patient_mm, double right_px, double down_px) {
  const double rad_per_px = std::numbers::pi / camera.width_px;
  const Eigen::Vector3d about = camera_from_patient * about_in_patient_mm;
  // What lies before the point, at -z of it, goes right for a turn about -y and down for one about x.
  const Eigen::Matrix3d turn = rotation_exp(rad_per_px * Eigen::Vector3d(down_px, -right_px, 0));
  return Transform<Camera, Camera>(turn, Eigen::Vector3d(about - turn * about)) * camera_from_patient;
}

Transform<Camera, Patient> approached(const Transform<Camera, Patient>& camera_from_patient,
                                      const Eigen::Vector3d& point_in_patient_mm, double notches) {
  constexpr double kNearest_mm = 10, kFurthest_mm = 10'000;
  const Eigen::Vector3d point = camera_from_patient * point_in_patient_mm;
  const double before_mm = point.norm();
  if (!(before_mm > 0)) return camera_from_patient;
  const double after_mm = std::clamp(before_mm * std::pow(0.9, notches), kNearest_mm, kFurthest_mm);
  return {camera_from_patient.rotation(), camera_from_patient.translation() + (after_mm / before_mm - 1) * point};
}

}  // namespace birdseye::host
