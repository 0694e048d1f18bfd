#include "host/registration/views/view_advice.hpp"

#include <Eigen/LU>
#include <cmath>

#include "calibration/base/units.hpp"

namespace birdseye::host {

namespace {

constexpr double kPrior = 0.05;  // of a view's information
constexpr double kReachDeg = 40, kStepDeg = 10;
constexpr double kWorthIt = 0.1;  // less than so much better is no reason to move

Eigen::Vector3d ray_of(const Transform<Camera, Patient>& camera_from_patient, const Eigen::Vector3d& middle_mm) {
  return (middle_mm - camera_from_patient.inverse().translation()).normalized();
}

Eigen::Matrix3d told_by(const Eigen::Vector3d& ray) {
  return Eigen::Matrix3d::Identity() - ray * ray.transpose();
}

double open(const Eigen::Matrix3d& information) {
  return information.inverse().trace();
}

}  // namespace

ViewAdvice advise_view(std::span<const Transform<Camera, Patient>> kept, const Transform<Camera, Patient>& now,
                       const Eigen::Vector3d& middle_in_patient_mm) {
  Eigen::Matrix3d known = kPrior * Eigen::Matrix3d::Identity();
  for (const auto& view : kept) known += told_by(ray_of(view, middle_in_patient_mm));
  const double before = open(known);
  const Eigen::Vector3d here = ray_of(now, middle_in_patient_mm);
  ViewAdvice advice;
  advice.gain_now = 1 - open(known + told_by(here)) / before;
  advice.gain_best = advice.gain_now;
  // The camera's axes in the patient frame: x to the right of the picture, y down.
  const Eigen::Matrix3d patient_from_camera = now.rotation().transpose();
  Eigen::Vector2d best_deg(0, 0);
  const int steps = static_cast<int>(kReachDeg / kStepDeg);
  for (int right = -steps; right <= steps; ++right) {
    for (int down = -steps; down <= steps; ++down) {
      const Eigen::Vector2d deg(kStepDeg * right, kStepDeg * down);
      if (deg.norm() > kReachDeg) continue;
      const Eigen::Vector3d moved =
          patient_from_camera * Eigen::Vector3d(std::tan(deg.x() * kRadPerDeg), std::tan(deg.y() * kRadPerDeg), 0);
      const Eigen::Vector3d ray = (here - moved).normalized();  // the camera goes one way, its ray leans the other
      const double gain = 1 - open(known + told_by(ray)) / before;
      if (gain <= advice.gain_best + 1e-9) continue;
      advice.gain_best = gain;
      best_deg = deg;
    }
  }
  if (advice.gain_best >= advice.gain_now + kWorthIt) advice.look_from_deg = best_deg;
  return advice;
}

}  // namespace birdseye::host
