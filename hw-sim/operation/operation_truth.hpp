#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/record/calibration_record.hpp"
#include "hw-sim/minibird/tracker_script.hpp"
#include "hw-sim/operation/hand_path.hpp"
#include "hw-sim/world/happenings.hpp"

namespace birdseye::hw_sim {

/// Where everything of an operation truly is, at any time of it (s). All of it follows from a seed, but for the way of
/// the pointer, which the surgeon decides as the operation goes.
class OperationTruth {
 public:
  /// width_px, height_px: of the video. happenings: what befalls patient, table and transmitter. reference: whether a
  /// third bird is fixed on the patient.
  OperationTruth(std::uint64_t seed, int width_px, int height_px, Happenings happenings, bool reference);

  [[nodiscard]] Transform<Tracker, Patient> tracker_from_patient(double at_s) const;
  [[nodiscard]] Transform<Camera, Patient> camera_from_patient(double at_s) const;
  /// Of the birds scope, pointer and reference, in this order.
  [[nodiscard]] Transform<Tracker, Sensor> tracker_from_sensor(std::size_t bird, double at_s) const;
  [[nodiscard]] std::size_t birds() const { return reference_ ? 3 : 2; }

  /// Where the pointer's tip goes, patient frame.
  HandPath& hand() { return hand_; }

  // Patient frame, mm.
  [[nodiscard]] const std::vector<Eigen::Vector3d>& fiducials_mm() const { return fiducials_mm_; }
  [[nodiscard]] const Eigen::Vector3d& target_mm() const { return target_mm_; }
  [[nodiscard]] const CameraModel& lens() const { return lens_; }
  [[nodiscard]] const Eigen::Vector3d& tip_in_pointer_mm() const { return tip_in_pointer_mm_; }

  /// What a calibration found of the scope: off the truth as much as it says of itself.
  [[nodiscard]] const calibration::CalibrationRecord& record() const { return record_; }

  /// How the tracker errs, one sigma of each axis.
  static constexpr BirdNoise kNoise{0.3, 0.1};

 private:
  void calibrate(std::uint64_t seed);

  Happenings happenings_;
  bool reference_;
  HandPath hand_;
  Transform<Tracker, Patient> at_rest_;  ///< tracker_from_patient before anything befell
  Transform<Camera, Sensor> camera_from_sensor_;
  Transform<Patient, Sensor> patient_from_reference_{Eigen::Matrix3d::Identity(), {40, 90, -10}};
  CameraModel lens_;
  Eigen::Vector3d tip_in_pointer_mm_{0, 0, 150}, target_mm_;
  std::vector<Eigen::Vector3d> fiducials_mm_;
  calibration::CalibrationRecord record_;
};

}  // namespace birdseye::hw_sim
