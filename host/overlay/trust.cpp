#include "host/overlay/trust.hpp"

#include <algorithm>
#include <cmath>

#include "calibration/points/point_error.hpp"

namespace birdseye::host {

TrustFigures vouched_for(const TrustFigures& stated) {
  TrustFigures out = stated;
  for (std::optional<double>* const figure :
       {&out.scope.camera_rms_px, &out.scope.held_out_px, &out.scope.held_out_mm, &out.fre_mm, &out.target_mm})
    *figure = figure->value_or(0);
  return out;
}

double registration_error_mm(double fre_mm, std::span<const Eigen::Vector3d> fiducials_mm,
                             const Eigen::Vector3d& target_mm) {
  const auto localisation = calibration::localisation_error_of(fre_mm, fiducials_mm.size());
  return calibration::TargetError(fiducials_mm, localisation.upper95_mm).rms_mm(target_mm);
}

std::optional<TargetMark> target_mark(const TargetView& view, const TrustFigures& figures) {
  if (!figures.target_mm || !figures.scope.held_out_mm) return std::nullopt;
  const CameraModel& camera = view.camera;
  const Eigen::Vector3d target_in_camera_mm = view.camera_from_patient * view.target_in_patient_mm;
  const auto at_px = project(camera, target_in_camera_mm);
  if (!at_px || at_px->minCoeff() < 0 || at_px->x() >= camera.width_px || at_px->y() >= camera.height_px)
    return std::nullopt;
  // Far off the axis a lens model folds back into the picture.
  const auto ray = unproject(camera, *at_px);
  constexpr double kSameRay = 1e-3;
  if (!ray || (ray->head<2>() - target_in_camera_mm.head<2>() / target_in_camera_mm.z()).norm() > kSameRay)
    return std::nullopt;
  // A pose's own sigma is an axis's, and counts what the hand may have done since; the jitter counts the angles.
  const double pose_mm = std::max(std::sqrt(3.0) * view.position_sigma_mm, view.jitter_mm.value_or(0));
  // Hand-eye's is given across the line of sight, of two axes.
  const double hand_eye_mm = std::sqrt(1.5) * *figures.scope.held_out_mm;
  const double rigid_mm = std::hypot(*figures.target_mm, hand_eye_mm, pose_mm);
  // Two of three axes show in the picture; 5.99 is the 95 % quantile of chi-square with two degrees of freedom. A
  // deformation may be much less sure of one axis, which may lie across the picture: its radius is taken whole.
  const MotionError motion = view.motion_error.value_or(MotionError{});
  const double radius_mm = std::hypot(rigid_mm * std::sqrt(5.99 / 3), motion.radius95_mm);
  return TargetMark{*at_px, std::hypot(rigid_mm, motion.rms_mm), radius_mm * camera.fx_px / target_in_camera_mm.z(),
                    radius_mm, view.motion_error.has_value()};
}

}  // namespace birdseye::host
