#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "calibration/geometry/camera_model.hpp"
#include "calibration/geometry/transform.hpp"
#include "calibration/record/calibration_record.hpp"
#include "hw-sim/minibird/tracker_script.hpp"
#include "hw-sim/operation/bench_path.hpp"
#include "hw-sim/operation/hand_path.hpp"
#include "hw-sim/world/happenings.hpp"

namespace birdseye::hw_sim {

/// By its name, the bird that is fixed on the patient, where there is one.
inline constexpr const char* kReference = "reference";

/// Where everything of an operation truly is, at any time of it (s). All of it follows from a seed, but for the way of
/// the pointer, which the surgeon decides as the operation goes.
class OperationTruth {
 public:
  /// width_px, height_px: of the video. happenings: what befalls patient, table and transmitter. reference: whether a
  /// third bird is fixed on the patient.
  OperationTruth(std::uint64_t seed, int width_px, int height_px, Happenings happenings, bool reference);

  /// The scope has yet to be calibrated: from the beginning on it goes about over a board.
  Result<void> begin_at_board(std::uint64_t seed);
  /// At each of these times the one of the two scopes that is in use is exchanged for the other.
  void exchange_scopes(std::vector<double> at_s);
  /// Some scopes have a rod that turns in the camera head, and it is not where it was as the scope was calibrated.
  void fit_rods(std::uint64_t seed);
  /// What is read off at whichever scope has a rod. Empty: none has one.
  [[nodiscard]] const std::optional<double>& rod_angle_deg() const { return rod_angle_deg_; }
  /// It goes to the patient from then on.
  void leave_board(double at_s) { left_board_s_ = at_s; }
  [[nodiscard]] bool at_board(double at_s) const { return bench_ && at_s < left_board_s_; }

  /// From the board to the patient.
  [[nodiscard]] bool carried(double at_s) const {
    return bench_ && at_s >= left_board_s_ && at_s < left_board_s_ + kCarry_s;
  }

  [[nodiscard]] Transform<Tracker, Patient> tracker_from_patient(double at_s) const;
  [[nodiscard]] Transform<Camera, Patient> camera_from_patient(double at_s) const;
  /// How far the organ has moved within the patient, and what was cut out of it.
  [[nodiscard]] OrganChange organ(double at_s) const;
  /// Only at the board.
  [[nodiscard]] Transform<Camera, Marker> camera_from_marker(double at_s) const;
  /// Of the birds scope, pointer and reference, in this order.
  [[nodiscard]] Transform<Tracker, Sensor> tracker_from_sensor(std::size_t bird, double at_s) const;
  [[nodiscard]] std::size_t birds() const { return reference_ ? 3 : 2; }

  /// The scope is moved about quickly and widely from then on, for kHurry_s.
  void hurry(double from_s);
  static constexpr double kHurry_s = 4, kCarry_s = 3;
  /// Where the pointer's tip goes, patient frame.
  HandPath& hand() { return hand_; }
  [[nodiscard]] const HandPath& hand() const { return hand_; }

  // Patient frame, mm.
  [[nodiscard]] const std::vector<Eigen::Vector3d>& fiducials_mm() const { return fiducials_mm_; }
  [[nodiscard]] const Eigen::Vector3d& target_mm() const { return target_mm_; }
  /// The signed distance to the surface of the organ that the target lies in.
  [[nodiscard]] static double organ_mm(const Eigen::Vector3d& point_in_patient_mm);
  [[nodiscard]] static const Eigen::Vector3d& organ_middle_mm();
  /// How often as large as usual the picture is: the lens is zoomed.
  [[nodiscard]] double zoom(double at_s) const { return happenings_.zoom(at_s); }
  /// Of the scope that is in use, as it is zoomed. Both scopes' pictures have the same size.
  [[nodiscard]] CameraModel lens(double at_s) const;
  /// As it was calibrated.
  [[nodiscard]] const CameraModel& lens_of(std::size_t scope) const { return scopes_[scope].lens; }
  /// 0 or 1.
  [[nodiscard]] std::size_t scope_in_use(double at_s) const;
  [[nodiscard]] std::size_t scopes_used() const { return exchanged_at_s_.empty() ? 1 : scopes_.size(); }
  [[nodiscard]] const Eigen::Vector3d& tip_in_pointer_mm() const { return tip_in_pointer_mm_; }

  /// What a calibration found of the scope: off the truth as much as it says of itself.
  [[nodiscard]] const calibration::CalibrationRecord& record_of(std::size_t scope) const {
    return scopes_[scope].record;
  }
  /// By that record, with the rod as it is.
  [[nodiscard]] const Transform<Camera, Sensor>& found_camera_from_sensor(std::size_t scope) const {
    return scopes_[scope].found_camera_from_sensor;
  }
  /// What the camera head says that it is.
  [[nodiscard]] const std::string& camera_name() const { return camera_name_; }
  /// As the pictures of a scope show it: its record has it from then on.
  void enter_round_field(std::size_t scope, const std::optional<RoundField>& seen);

  /// How the tracker errs, one sigma of each axis.
  static constexpr BirdNoise kNoise{0.3, 0.1};

 private:
  struct Scope {
    CameraModel lens;
    Transform<Camera, Sensor> camera_from_sensor, found_camera_from_sensor;
    calibration::CalibrationRecord record;
  };
  [[nodiscard]] Scope calibrated(const CameraModel& lens, const Transform<Camera, Sensor>& found,
                                 std::uint64_t seed) const;
  [[nodiscard]] double on_its_way_s(double at_s) const;
  /// Of a scope in a hurry, beside its way: the camera's turn (rad) and shift (mm).
  struct Swing {
    Eigen::Vector3d turn = Eigen::Vector3d::Zero(), shift_mm = Eigen::Vector3d::Zero();
  };
  [[nodiscard]] Swing swing(double at_s) const;
  [[nodiscard]] Transform<Camera, Patient> camera_within_patient(double at_s) const;
  [[nodiscard]] Transform<Camera, Patient> unturned_camera_from_patient(double at_s) const;

  Happenings happenings_;
  bool reference_;
  HandPath hand_;
  std::deque<double> hurried_s_;  ///< since when, the last few
  double ahead_s_ = 0;            ///< by those before
  std::optional<BenchPath> bench_;
  double left_board_s_ = std::numeric_limits<double>::infinity();
  Transform<Tracker, Patient> at_rest_;  ///< tracker_from_patient before anything befell
  Transform<Patient, Sensor> patient_from_reference_{Eigen::Matrix3d::Identity(), {40, 90, -10}};
  std::array<Scope, 2> scopes_;
  std::vector<double> exchanged_at_s_;
  std::string camera_name_;
  std::optional<double> rod_angle_deg_;
  Eigen::Vector3d tip_in_pointer_mm_, target_mm_;
  Eigen::Vector3d face_mm_;  ///< of the organ, where the scope looks at it
  std::vector<Eigen::Vector3d> fiducials_mm_;
};

}  // namespace birdseye::hw_sim
