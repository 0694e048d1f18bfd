#pragma once

#include <filesystem>
#include <optional>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/camera_parameters.hpp"
#include "calibration/geometry/rod.hpp"
#include "calibration/geometry/round_field.hpp"
#include "calibration/geometry/transform.hpp"
#include "host/overlay/trust.hpp"

namespace birdseye::calibration {
struct CalibrationRecord;
struct HandEyeResult;
}  // namespace birdseye::calibration

namespace birdseye::host {

class ScopeSetup;

/// What calibration and registration found; with it a frame's pose gives where the CT lies before the camera. Made by
/// ScopeSetup::registered alone, and not changed after.
class Setup {
 public:
  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  [[nodiscard]] const Transform<Camera, Sensor>& camera_from_sensor() const { return camera_from_sensor_; }
  [[nodiscard]] const Transform<Tracker, Patient>& tracker_from_patient() const { return tracker_from_patient_; }
  [[nodiscard]] Transform<Camera, Patient> camera_from_patient(
      const Transform<Tracker, Sensor>& tracker_from_sensor) const {
    return camera_from_sensor_ * tracker_from_sensor.inverse() * tracker_from_patient_;
  }

 private:
  friend class ScopeSetup;
  Setup(const CameraModel& camera, const Transform<Camera, Sensor>& camera_from_sensor,
        const Transform<Tracker, Patient>& tracker_from_patient)
      : camera_(camera), camera_from_sensor_(camera_from_sensor), tracker_from_patient_(tracker_from_patient) {}

  CameraModel camera_;
  Transform<Camera, Sensor> camera_from_sensor_;
  Transform<Tracker, Patient> tracker_from_patient_;
};

/// How the scope is calibrated: its lens, where that sits on its sensor, and how well both are known. There are four
/// ways to one and no other.
class ScopeSetup {
 public:
  /// A rod's angle is missing until turned_to() says it. Empty where the record has no lens or no hand-eye. stated:
  /// figures that count in place of the record's.
  static std::optional<ScopeSetup> of_record(const calibration::CalibrationRecord& record,
                                             const ScopeFigures& stated = {});
  /// found: solved. camera_rms_px and camera_covariance: of the lens it was found with; empty: they are not known.
  static ScopeSetup of_hand_eye(const CameraModel& camera, std::optional<double> camera_rms_px,
                                const calibration::HandEyeResult& found,
                                const std::optional<CameraMatrix>& camera_covariance = std::nullopt);
  /// A lens (OpenCV YAML) and a 4x4 matrix. stated: what somebody says of them, for the files hold no figures. An error
  /// names the file.
  static Result<ScopeSetup> of_files(const std::filesystem::path& camera,
                                     const std::filesystem::path& camera_from_sensor, const ScopeFigures& stated);

  /// What one of the other ways made, and an operation kept.
  static Result<ScopeSetup> of_values(const CameraModel& camera, const std::optional<CameraMatrix>& camera_covariance,
                                      const Transform<Camera, Sensor>& camera_from_sensor, const ScopeFigures& figures);

  [[nodiscard]] const CameraModel& camera() const { return camera_; }
  [[nodiscard]] const Transform<Camera, Sensor>& camera_from_sensor() const { return camera_from_sensor_; }
  [[nodiscard]] const ScopeFigures& figures() const { return figures_; }
  /// As the lens's pictures showed it; empty: nothing says so.
  [[nodiscard]] const std::optional<RoundField>& round_field() const { return round_field_; }
  /// How well the lens is known; empty: nothing says so.
  [[nodiscard]] const std::optional<CameraMatrix>& camera_covariance() const { return figures_.camera_covariance; }
  /// The same scope with its rod at an angle, as a person reads it off. A scope without a rod stays as it is; one that
  /// was calibrated at one angle only holds at that angle, give or take two degrees.
  [[nodiscard]] ScopeSetup turned_to(double rod_angle_deg) const;
  /// The same scope, of whose lens the edge of the picture's round field is known.
  [[nodiscard]] ScopeSetup with_round_field(const std::optional<RoundField>& field) const;
  /// Whether places lie in its pictures, by a pose of its sensor, where they lie in the other's.
  [[nodiscard]] bool sees_as(const ScopeSetup& other) const {
    return camera_ == other.camera_ && camera_from_sensor_.matrix() == other.camera_from_sensor_.matrix();
  }
  /// Whether the scope's rod can be at other angles than now.
  [[nodiscard]] bool has_rod() const { return rod_.has_value(); }
  /// At which the rod was when the scope was calibrated; 0 without a rod.
  [[nodiscard]] double calibrated_at_deg() const { return rod_ ? rod_->calibrated_at_deg : 0; }
  [[nodiscard]] Setup registered(const Transform<Tracker, Patient>& tracker_from_patient) const;

 private:
  struct Rod {
    double calibrated_at_deg = 0;
    std::optional<RodScope> model;  ///< empty: nobody measured how it turns
  };

  static std::optional<Rod> rod_of(const calibration::CalibrationRecord& record);
  ScopeSetup() = default;

  CameraModel camera_;
  std::optional<RoundField> round_field_;
  Transform<Camera, Sensor> camera_from_sensor_;
  std::optional<Rod> rod_;
  ScopeFigures figures_;
};

}  // namespace birdseye::host
