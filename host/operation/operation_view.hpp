#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/base/verdict.hpp"
#include "host/guide/guide_state.hpp"
#include "host/operation/findings.hpp"
#include "host/operation/live_step.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/step_states.hpp"
#include "host/overlay/trust.hpp"
#include "host/registration/views/view_advice.hpp"
#include "host/render/scene/transfer_function.hpp"

namespace birdseye::host {

/// How the operation stands, for whoever shows it: values alone.
struct OperationView {
  LiveStep step = LiveStep::connect;
  bool frozen = false;
  bool simulated = false;             ///< by the simulated cart, whose operator touches the fiducials and nothing else
  bool watched = false;               ///< whether the video is held against the deformed surface
  bool asks_for_instruments = false;  ///< whether tracker and camera are the same as before, for nothing tells it
  bool overlay_hidden = false;        ///< a person has switched it off
  bool has_rod = false;               ///< the scope's rod turns: its angle has to be known
  bool board_named = false;           ///< there is a board to calibrate with
  bool guiding = false;
  bool fits_at_one = false;  ///< in doubt, it fits at one place: another is asked for
  bool unconfirmed = false;  ///< the registration is an earlier window's, and nobody has looked whether it holds
  bool registration_held_back = false;  ///< what the fiducials gave, as long as other instruments are there
  bool deforming = false;
  bool stroking = false;            ///< the pointer, over the organ
  bool organ_moved = false;         ///< since the views that the deformation was found by
  bool looking_for_marker = false;  ///< where a person has pointed at the CT
  bool fits_poorly = false;         ///< the touches, to the markers
  bool deformed_with_care = false;  ///< its step's note says why
  bool surface_told = false;        ///< a check of the last ten seconds could tell whether the organ has moved
  bool surface_unchecked = false;   ///< it is watched, and nothing was found yet since it was matched
  bool asks_for_patient = false;    ///< and waits for it before anything is registered
  std::string not_signed;           ///< what is used that no known machine signed; empty: nothing
  bool patient_confirmed = false;   ///< a person has compared name, ID and date with the patient on the table
  std::array<StepNote, kLiveSteps> notes;
  std::string fault;
  bool writing = false;  ///< what was found, and is not yet kept; the simulator's laws ask
  std::string
      primary_refused;  ///< why Space and the pedal would do nothing now; empty: they do what primary_words() says

  LinkState link;
  std::string reference;  ///< the bird that all poses are relative to; empty: none

  std::optional<double> rod_angle_deg;  ///< as somebody has said it; empty: nobody has, or there is no rod
  std::optional<GuideState> guide;      ///< in its step, while it guides
  std::vector<std::string> guide_lines;
  std::optional<Verdict> calibration_verdict;

  std::size_t fiducials_wanted = 0;                    ///< 0: as many as come
  std::optional<std::size_t> markers_seen;             ///< fiducials in the CT; empty as long as they are looked for
  std::vector<Eigen::Vector3d> markers_in_patient_mm;  ///< fiducials in the CT, those that a person has picked too
  std::vector<NamedPoint> landmarks;                   ///< in the CT as it was taken
  std::string pick_line;                               ///< what came of that; empty: nothing yet
  std::vector<TouchedFiducial> touches;
  std::optional<std::size_t> odd_touch;  ///< which of them is off, from 0; empty: it cannot be told, or all fit
  std::string touch_loses;  ///< what is dropped with the registration, in words: views, a deformation; empty: nothing
  std::optional<std::size_t> asked_to_take_back;  ///< a touch, from 0; another press of the key does it, and drops that
  std::optional<double> fre_mm;
  std::string registration_fault;

  std::size_t touched_places = 0;  ///< by strokes
  std::string stroke_line;         ///< of them, in words; empty: nothing is to be said

  std::optional<ViewAdvice> view_advice;  ///< in its step, where an overlay is drawn

  std::string deform_progress;  ///< how far it is, in its step
  std::shared_ptr<const DeformedOrgan> deformed;
  std::optional<double> target_moved_mm;  ///< by the deformation; empty: there is none, or no landmark is the target
  std::string surface_check;  ///< what the video says of the deformed surface; empty: there is none, or no check yet

  std::optional<CheckedLandmark> checked;  ///< by which the registration was looked at; empty: by none yet
  std::optional<CheckReading> check;       ///< empty: no pointer is seen, or the patient is not registered

  /// Of the first landmark, else of the CT's middle. From what is known: the fiducials, hand-eye held out, the
  /// tracker's noise, and the deformation, where there is one. Empty where no overlay is drawn, or it is out of view.
  std::optional<TargetMark> target;

  std::optional<ErrorBudget> expected;  ///< of the newest frame, seen or out of view; empty: a part of it is not known

  std::shared_ptr<const PatientPlan> patient;  ///< null: it is not read yet
  std::string patient_fault;                   ///< why this CT cannot be that of the patient on the table
  PatientFiles patient_files;
  std::string engine_asked;  ///< as it was named: "auto" too
  std::string engine_name;   ///< what runs, in words; empty: the CT cannot be drawn yet
  std::shared_ptr<const TransferFunction> transfer, drawn_by;  ///< that is asked for, and that the engine draws by
  std::uint64_t shapes = 0;  ///< another number: another CT, or it is deformed in another way

  [[nodiscard]] const StepNote& note(LiveStep which) const { return notes[static_cast<std::size_t>(which)]; }
};

/// Where slices of the CT are opened at: the target where a landmark is one, and while fiducials are touched the first
/// of these. Empty: there is neither.
std::optional<Eigen::Vector3d> first_place_mm(const OperationView& operation);

/// What the space bar and the pedal do in the present step.
std::string primary_words(const OperationView& operation);

}  // namespace birdseye::host
