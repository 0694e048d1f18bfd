#include "host/overlay/scope_setup.hpp"

#include <cmath>

#include "calibration/base/units.hpp"
#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/record/calibration_record.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

/// A hand-eye that was found from poses alone, without pictures, has no corners to be off: the solver states 0 px.
std::optional<double> if_measured(double px) {
  return px > 0 ? std::optional(px) : std::nullopt;
}

/// The solver's rotation turns about the sensor, far from the camera: exp(w) R, t + d. covariance: of (w, d).
Eigen::Matrix<double, 6, 6> about_camera(const Eigen::Matrix<double, 6, 6>& covariance,
                                         const Transform<Camera, Sensor>& camera_from_sensor) {
  const Eigen::Vector3d& t = camera_from_sensor.translation();
  Eigen::Matrix<double, 6, 6> by = Eigen::Matrix<double, 6, 6>::Identity();
  by.bottomLeftCorner<3, 3>() << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;  // s = d + t x w
  return by * covariance * by.transpose();
}

}  // namespace

std::optional<ScopeSetup::Rod> ScopeSetup::rod_of(const calibration::CalibrationRecord& record) {
  if (const auto& rod = record.hand_eye->rod) {
    return Rod{rod->reference_angle_deg, RodScope{record.hand_eye->camera_from_sensor, rod->axis_in_sensor,
                                                  rod->axis_point_in_sensor_mm, rod->picture_turn}};
  }
  if (record.lens->rod_angle_deg) return Rod{*record.lens->rod_angle_deg, std::nullopt};
  return std::nullopt;
}

std::optional<ScopeSetup> ScopeSetup::of_record(const calibration::CalibrationRecord& record,
                                                const ScopeFigures& stated) {
  if (!record.lens || !record.hand_eye) return std::nullopt;
  ScopeSetup out;
  out.camera_ = record.lens->camera;
  out.round_field_ = record.lens->round_field;
  out.camera_from_sensor_ = record.hand_eye->camera_from_sensor;
  out.figures_ = {record.lens->rms_px, if_measured(record.hand_eye->held_out_px), record.hand_eye->held_out_mm};
  if (!record.lens->covariance.isZero(0)) out.figures_.camera_covariance = record.lens->covariance;
  if (!record.hand_eye->covariance.isZero(0))
    out.figures_.hand_eye_covariance = about_camera(record.hand_eye->covariance, out.camera_from_sensor_);
  out.figures_.hand_eye_stations = record.hand_eye->independent_stations;
  if (stated.camera_rms_px) out.figures_.camera_rms_px = stated.camera_rms_px;
  if (stated.held_out_px) out.figures_.held_out_px = stated.held_out_px;
  if (stated.held_out_mm) {
    out.figures_.held_out_mm = stated.held_out_mm;
    out.figures_.hand_eye_stations = stated.hand_eye_stations;
  }
  out.rod_ = rod_of(record);
  out.figures_.rod_angle_missing = out.rod_.has_value();
  return out;
}

ScopeSetup ScopeSetup::turned_to(double rod_angle_deg) const {
  ScopeSetup out = *this;
  if (!rod_) return out;
  const double turned_deg = rod_angle_deg - rod_->calibrated_at_deg;
  if (rod_->model) {
    out.camera_from_sensor_ = rod_->model->camera_from_sensor(turned_deg * kRadPerDeg);
    out.figures_.rod_angle_missing = !std::isfinite(turned_deg);
  } else {
    constexpr double kSameAngle_deg = 2;
    out.figures_.rod_angle_missing = !(std::abs(std::remainder(turned_deg, 360)) <= kSameAngle_deg);
  }
  return out;
}

ScopeSetup ScopeSetup::with_round_field(const std::optional<RoundField>& field) const {
  ScopeSetup out = *this;
  out.round_field_ = field;
  return out;
}

ScopeSetup ScopeSetup::of_hand_eye(const CameraModel& camera, std::optional<double> camera_rms_px,
                                   const calibration::HandEyeResult& found,
                                   const std::optional<CameraMatrix>& camera_covariance) {
  ScopeSetup out;
  out.camera_ = camera;
  out.camera_from_sensor_ = found.camera_from_sensor;
  out.figures_ = {camera_rms_px, if_measured(found.held_out_px), found.held_out_mm};
  out.figures_.hand_eye_stations = found.independent_stations;
  out.figures_.camera_covariance = camera_covariance;
  if (!found.covariance.isZero(0))
    out.figures_.hand_eye_covariance = about_camera(found.covariance, out.camera_from_sensor_);
  return out;
}

Result<ScopeSetup> ScopeSetup::of_files(const std::filesystem::path& camera,
                                        const std::filesystem::path& camera_from_sensor, const ScopeFigures& stated) {
  auto lens = read_camera(camera);
  if (!lens) return lens.error();
  const auto covariance = read_camera_covariance(camera);
  if (!covariance) return covariance.error();
  const auto hand_eye = read_pose(camera_from_sensor);
  if (!hand_eye) return hand_eye.error();
  ScopeSetup out;
  out.camera_ = *lens;
  out.camera_from_sensor_ = Transform<Camera, Sensor>::from_matrix(*hand_eye);
  out.figures_ = stated;
  out.figures_.camera_covariance = *covariance;
  return out;
}

Result<ScopeSetup> ScopeSetup::of_values(const CameraModel& camera,
                                         const std::optional<CameraMatrix>& camera_covariance,
                                         const Transform<Camera, Sensor>& camera_from_sensor,
                                         const ScopeFigures& figures) {
  if (auto sound = check(camera); !sound) return sound.error();
  ScopeSetup out;
  out.camera_ = camera;
  out.camera_from_sensor_ = camera_from_sensor;
  out.figures_ = figures;
  out.figures_.camera_covariance = camera_covariance;
  return out;
}

Setup ScopeSetup::registered(const Transform<Tracker, Patient>& tracker_from_patient) const {
  return {camera_, camera_from_sensor_, tracker_from_patient};
}

}  // namespace birdseye::host
