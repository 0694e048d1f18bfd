#include "host/overlay/scope_setup.hpp"

#include "calibration/hand_eye/hand_eye_calibration.hpp"
#include "calibration/record/calibration_record.hpp"
#include "host/files/camera_covariance.hpp"
#include "host/files/camera_files.hpp"
#include "host/files/text_files.hpp"

namespace birdseye::host {

namespace {

/// A hand-eye that was found from poses alone, without pictures, has no corners to be off: the solver states 0 px.
std::optional<double> if_measured(double px) {
  return px > 0 ? std::optional(px) : std::nullopt;
}

}  // namespace

std::optional<ScopeSetup> ScopeSetup::of_record(const calibration::CalibrationRecord& record,
                                                const ScopeFigures& stated) {
  if (!record.lens || !record.hand_eye) return std::nullopt;
  ScopeSetup out;
  out.camera_ = record.lens->camera;
  if (!record.lens->covariance.isZero(0)) out.camera_covariance_ = record.lens->covariance;
  out.camera_from_sensor_ = record.hand_eye->camera_from_sensor;
  out.figures_ = {record.lens->rms_px, if_measured(record.hand_eye->held_out_px), record.hand_eye->held_out_mm};
  if (stated.camera_rms_px) out.figures_.camera_rms_px = stated.camera_rms_px;
  if (stated.held_out_px) out.figures_.held_out_px = stated.held_out_px;
  if (stated.held_out_mm) out.figures_.held_out_mm = stated.held_out_mm;
  return out;
}

ScopeSetup ScopeSetup::of_hand_eye(const CameraModel& camera, std::optional<double> camera_rms_px,
                                   const calibration::HandEyeResult& found,
                                   const std::optional<CameraMatrix>& camera_covariance) {
  ScopeSetup out;
  out.camera_ = camera;
  out.camera_covariance_ = camera_covariance;
  out.camera_from_sensor_ = found.camera_from_sensor;
  out.figures_ = {camera_rms_px, if_measured(found.held_out_px), found.held_out_mm};
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
  out.camera_covariance_ = *covariance;
  out.camera_from_sensor_ = Transform<Camera, Sensor>::from_matrix(*hand_eye);
  out.figures_ = stated;
  return out;
}

Setup ScopeSetup::registered(const Transform<Tracker, Patient>& tracker_from_patient) const {
  return {camera_, camera_from_sensor_, tracker_from_patient};
}

}  // namespace birdseye::host
