// The part of the session that tells how far the overlay may be trusted.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calibration/points/point_error.hpp"
#include "host/operation/live_session.hpp"

namespace birdseye::host {

void LiveSession::expect_registration_error() {
  // Few residuals may be small by chance: the bound under which the localisation error lies, not its estimate.
  const auto localisation = calibration::localisation_error_of(*fre_mm_, fitted_in_patient_mm_.size());
  known_.target_mm =
      calibration::TargetError(fitted_in_patient_mm_, localisation.upper95_mm).rms_mm(target_in_patient_mm());
}

Eigen::Vector3d LiveSession::target_in_patient_mm() const {
  if (!patient_->landmarks.empty()) return patient_->landmarks.front().place_mm;
  const Volume& ct = patient_->ct;
  return ct.patient_from_voxel * Eigen::Vector3d(0.5 * Eigen::Vector3d(ct.size[0] - 1, ct.size[1] - 1, ct.size[2] - 1));
}

Eigen::Vector3d LiveSession::as_shown_mm(const Eigen::Vector3d& place_in_ct_mm) const {
  return deformation_ ? deformation_->field.deformed_of(place_in_ct_mm) : place_in_ct_mm;
}

std::optional<TargetMark> LiveSession::target_mark() const {
  const auto& setup = picture_.setup();
  const auto& camera_from_patient = picture_.camera_from_patient();
  if (!setup || !camera_from_patient || !patient_) return std::nullopt;
  const Eigen::Vector3d target_mm = *camera_from_patient * as_shown_mm(target_in_patient_mm());
  const auto at_px = project(setup->camera, target_mm);
  if (!at_px || at_px->minCoeff() < 0 || at_px->x() >= setup->camera.width_px || at_px->y() >= setup->camera.height_px)
    return std::nullopt;
  // Far off the axis a lens model folds back into the picture.
  const auto ray = unproject(setup->camera, *at_px);
  constexpr double kSameRay = 1e-3;
  if (!ray || (ray->head<2>() - target_mm.head<2>() / target_mm.z()).norm() > kSameRay) return std::nullopt;
  // A pose's own sigma is an axis's, and counts what the hand may have done since; the jitter counts the angles.
  const double pose_mm =
      std::max(std::sqrt(3.0) * picture_.frame()->info.pose.position_sigma_mm, jitter_.rms_mm().value_or(0));
  const double hand_eye_mm = std::sqrt(1.5) * known_.hand_eye_mm;  // it is given across the line of sight, of two axes
  const double deformation_mm = deformation_ ? deformation_->uncertainty_mm.value_or(0) : 0;
  const double rms_mm = std::hypot(std::hypot(known_.target_mm, hand_eye_mm), std::hypot(pose_mm, deformation_mm));
  // Two of three axes show in the picture; 5.99 is the 95 % quantile of chi-square with two degrees of freedom.
  const double radius_mm = rms_mm * std::sqrt(5.99 / 3);
  return TargetMark{*at_px, rms_mm, radius_mm * setup->camera.fx_px / target_mm.z(), radius_mm,
                    deformation_ && deformation_->uncertainty_mm};
}

std::optional<CheckReading> LiveSession::check() const {
  if (!tracker_from_patient_ || tips_.empty() || !patient_) return std::nullopt;
  CheckReading reading;
  reading.tip_in_patient_mm = tracker_from_patient_->inverse() * tips_.back().second;
  const auto consider = [&](const std::string& name, const Eigen::Vector3d& place_mm) {
    const double distance_mm = (as_shown_mm(place_mm) - reading.tip_in_patient_mm).norm();
    if (!reading.nearest.empty() && distance_mm >= reading.distance_mm) return;
    reading.nearest = name;
    reading.distance_mm = distance_mm;
  };
  for (const NamedPoint& landmark : patient_->landmarks) consider(landmark.name, landmark.place_mm);
  for (std::size_t i = 0; markers_in_patient_mm_ && i < markers_in_patient_mm_->size(); ++i)
    consider(fmt::format("fiducial {}", i + 1), (*markers_in_patient_mm_)[i]);
  return reading;
}

}  // namespace birdseye::host
