#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/base/result.hpp"
#include "host/deform/displacement_field.hpp"
#include "host/operation/instruments.hpp"
#include "host/overlay/scope_setup.hpp"
#include "host/overlay/trust.hpp"
#include "host/volume/volume.hpp"

/// What the steps of an operation find: values, which later steps are given, whoever found them.
namespace birdseye::host {

struct GuidedCalibration;

/// How the scope is calibrated.
struct CalibratedScope {
  ScopeSetup scope;
  std::string made_utc;           ///< 2026-11-22T09:30:00Z
  bool by_board = false;          ///< here, by the board; else by a record
  Instruments found_with{};       ///< of one by a record, those that the record is of, which the appliance judges
  std::string scope_name{};       ///< as its owner calls it; empty: nobody has told it, as over the board
  std::string record_scope{};     ///< over the board: the scope of the record that the appliance had then; empty: none
  std::string in_place_of_utc{};  ///< over the board: when the appliance's record then was made; empty: there was none
};
/// By what was solved of stations over the board. Refuses, with the first reason, what the verdict fails.
Result<CalibratedScope> calibrated_by_board(const GuidedCalibration& found, const std::string& made_utc);

/// Two places of the CT that are nearer are one: they were written down, or picked, twice.
inline constexpr double kSamePlace_mm = 0.5;

/// How far a place of the CT was off as the pointer was last held there.
struct PlaceOff {
  Eigen::Vector3d in_ct_mm;  ///< of the CT as it was taken
  std::string name;
  double off_mm = 0;
  bool deformed = false;  ///< of the CT as it was shown then
  bool refuses = false;   ///< a landmark that was off by too much to draw, and has not been found to fit since
};

/// How the patient is registered.
struct RegisteredPatient {
  Transform<Tracker, Patient> tracker_from_patient;
  double fre_mm = 0;
  std::vector<Eigen::Vector3d> fiducials_in_patient_mm;  ///< those that were touched: three or more
  Instruments found_with{};                              ///< the tracker counts: touches are in its frame
  std::string made_utc{};
  std::string doubt{};  ///< what cannot be told by these touches; empty: nothing
  std::vector<PlaceOff> off{};
  /// The tip, as somebody last touched or checked with it. Empty: nobody kept it.
  std::optional<Eigen::Vector3d> tip_in_pointer_mm{};
};

/// How the organ is deformed, and how well that is known; what was not estimated is absent.
struct DeformedOrgan {
  DisplacementField field;            ///< patient LPS, mm
  std::optional<double> seen_rms_mm;  ///< to be expected of the surface that the views see, of three axes together
  std::optional<MotionError> target;
  std::string made_utc{};
  std::optional<Eigen::Vector3d> target_at_rest_mm{};  ///< of which target that is, in the CT as it was taken
  std::string care{};                                  ///< why it is to be used with care; empty: it passed
};

struct TouchFit {
  RegisteredPatient registered;
  std::vector<double> residuals_mm;  ///< of the touched points, in their order
  std::string doubt;                 ///< what cannot be told by these touches, with the remedy; empty: nothing
};
/// By points that the pointer touched, of which nobody has said which is which. Refuses what match_and_fit refuses, and
/// what judge_fiducial_points fails (Errc::unsupported): touches that are mirrored or of another scale, fiducials
/// outside of the CT's body.
/// ct: null where it is not at hand; check_places is due then.
Result<TouchFit> register_by_touches(std::span<const Eigen::Vector3d> markers_in_patient_mm,
                                     std::span<const Eigen::Vector3d> touched_in_tracker_mm, const Volume* ct);
/// Refuses fiducials that lie outside of the CT's body, by their places.
Result<void> check_places(std::span<const Eigen::Vector3d> fiducials_in_patient_mm, const Volume& ct);

/// By what the gate judges an overlay of this scope and this registration. target_in_patient_mm: in the CT as it was
/// taken.
TrustFigures trust_figures(const ScopeFigures& scope, const RegisteredPatient& registered,
                           const Eigen::Vector3d& target_in_patient_mm);

}  // namespace birdseye::host
