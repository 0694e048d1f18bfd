#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/link/event_stream.hpp"
#include "host/operation/calibration_step.hpp"
#include "host/operation/connection_step.hpp"
#include "host/operation/deformation_step.hpp"
#include "host/operation/fiducial_step.hpp"
#include "host/operation/instruments.hpp"
#include "host/operation/operation_keeper.hpp"
#include "host/operation/operation_view.hpp"
#include "host/operation/organ_motion.hpp"
#include "host/operation/organ_strokes.hpp"
#include "host/operation/patient_step.hpp"
#include "host/operation/place_picks.hpp"
#include "host/operation/places_off.hpp"
#include "host/operation/pointer_tip.hpp"
#include "host/operation/reference_sensor.hpp"
#include "host/operation/surface_watch.hpp"
#include "host/operation/view_step.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/overlay/video_watch.hpp"

namespace birdseye::host {

struct LiveSettings {
  PatientFiles patient;
  std::string transfer = "tumour-and-vessels", engine = "cpu";
  EngineMaker make_engine = engine_by_name;
  std::string scope = "scope", pointer = "pointer";  ///< birds, by their names
  std::string reference;  ///< the bird that is fixed on patient or table; empty: the one that the appliance names
  std::optional<calibration::Pattern> pattern;       ///< the board to calibrate with
  std::optional<Eigen::Vector3d> tip_in_pointer_mm;  ///< else by the record
  std::optional<double> rod_angle_deg;  ///< of a scope whose rod turns, as it is read off; empty: nobody has said it
  /// Nothing is drawn before the video has been seen to move as the scope's poses say. False: of a scene without any
  /// pattern, which shows no motion.
  bool video_must_agree = true;
  std::size_t fiducials = 0;     ///< how many to touch; 0: as many as are wanted
  std::string patient_id;        ///< of the patient on the table, where another system knows it; else a person is asked
  std::filesystem::path out;     ///< where results go; empty: none are kept
  std::filesystem::path resume;  ///< out of an earlier window, to go on from; or empty
  Authors authors = Authors::for_once();  ///< whose records and operations are used, and who signs what is found
  std::string recording_doubt;            ///< that no known machine signed what is played; empty: one did, or none is
};

/// The order of the operation, from the first connection to the running overlay; knows nothing of windows. It gives the
/// appliance's events and a person's keys to the step that they are for, and to each step what the others have found;
/// the steps do the work, the long part on threads of their own, and know nothing of each other.
class LiveWorkflow {
 public:
  /// Reads the patient, if there is one; what is wrong there is the view's fault.
  explicit LiveWorkflow(LiveSettings settings);

  void take(const wire::Event& event, HostTime now, const std::optional<ClockGap>& clock);
  /// What a check of the video against the deformed surface has found.
  void take(const CheckedSurface& checked);
  /// Collects what threads have finished, and looks whether this machine has slept.
  void tick();
  /// How long this machine has slept since it was started. Where it slept since it was last told, nobody saw what
  /// moved.
  void note_sleep(Duration asleep);
  /// The last: waits until what was found is kept, or cannot be, which the view's fault says.
  void finish() { keeper_.finish(); }
  /// The link to the appliance came or went; may_retry as ConnectionStep has it.
  void set_link(bool connected, const std::string& words, bool may_retry = false);
  /// What only a simulated cart can tell without being asked.
  void set_sheet(const calibration::Pattern& pattern, const Eigen::Vector3d& tip_in_pointer_mm, std::size_t fiducials);
  /// Reads another patient.
  void load(const PatientFiles& files) { patient_.load(files); }

  // What a person does.
  void confirm_instruments();  ///< tracker and camera are the same as before the connection was lost
  void confirm_patient();      ///< the CT is of the patient on the table; nothing is registered before
  /// Looks for a marker at a place of the CT, to be one more fiducial, or a landmark: its centre, or the place itself.
  void pick(PlacePicks::Kind kind, const Eigen::Vector3d& place_in_patient_mm);
  /// The fiducial of the CT that is nearest to a place is not used any more.
  void drop_marker(const Eigen::Vector3d& place_in_patient_mm);
  /// The space bar and the pedal. A press within a second of that which confirmed the patient does nothing.
  void primary(HostTime now);
  /// The matching that runs. Space and the pedal do not do it: a foot that presses twice would.
  void cancel_matching() { deformation_.cancel(); }
  void undo();  ///< the last thing of the present step
  /// One touch, from 0. Where views or a deformation are dropped with it, it is asked for twice.
  void take_back(std::size_t touch);
  void stroke();  ///< of the pointer over the organ: begins one, or ends it
  void go_on();   ///< to the next step, where this one is done
  void go_to(LiveStep step);
  void freeze_or_let_go() {
    frozen_ = !frozen_;
    picture_.freeze(frozen_);
  }
  /// Not of a frozen picture, which bears none.
  void hide_or_show_overlay() {
    if (!frozen_) picture_.hide(!picture_.hidden());
  }
  /// The rod of a scope that has one is turned by so much; the first time it is taken to be as it was calibrated.
  void turn_rod(double by_deg);
  void set_transfer(const TransferFunction& transfer) { patient_.set_transfer(transfer); }
  void set_look(const OverlayLook& look) { picture_.set_look(look); }

  /// Draws the newest frame, if that is still to be done.
  void draw() { picture_.draw(); }
  /// What of it may be shown at this moment.
  ShownPicture shown_at(HostTime now) {
    heard_ = now;
    return picture_.at(now);
  }
  [[nodiscard]] const LivePicture& picture() const { return picture_; }
  /// What the frame that is shown was taken with.
  [[nodiscard]] const PictureHardware& taken_with() const { return taken_with_; }
  [[nodiscard]] OperationView view() const;
  /// The CT as it is shown, from another place than the scope's. Empty: it cannot be drawn yet.
  [[nodiscard]] std::optional<ImageRgba> ct_seen_from(const CameraModel& camera,
                                                      const Transform<Camera, Patient>& camera_from_patient,
                                                      const RenderSettings& settings) const;

 private:
  void take_relative(const wire::Event& event, HostTime now, const std::optional<ClockGap>& clock);
  void use_reference(const std::string& name);
  void take(ReferenceSensor::News news);
  void doubt_registration(const std::string& why);
  [[nodiscard]] std::string why_unregistered() const;
  void doubt_steps(OperationView& out) const;
  /// Of what is used that no known machine signed.
  void tell_unsigned(OperationView& view) const;
  [[nodiscard]] std::string why_primary_refused() const;
  void take_birds(const wire::Birds& birds, HostTime now, const std::optional<ClockGap>& clock);
  void take(const wire::Calibration& calibration);
  void fit();
  void fit_anew();
  [[nodiscard]] std::string lost_with_registration() const;
  void take(const PlacePicks::Picked& picked);
  [[nodiscard]] bool asks_for_instruments() const;
  void judge_instruments();
  void follow_held_back();
  /// A frame or a pose has come; came: when the one before it did, and then this one. Doubts the registration after a
  /// long pause, if that counts.
  void note_pause(HostTime now, std::optional<HostTime>& came, bool counts);
  void note_looked_at();
  void note_landmarks();
  [[nodiscard]] bool asks_for_patient() const;
  [[nodiscard]] bool is_other_patients() const;
  void forget_views(const std::string& why);
  void forget_views_of_before();
  void show_shape();
  void show_margins();
  void update_setup();
  /// As it is calibrated, with its rod as it is turned now. Empty: it is not.
  [[nodiscard]] std::optional<ScopeSetup> scope_as_it_is() const;
  /// The registration is held back, maybe only because the appliance has not told yet which reference it has.
  [[nodiscard]] bool may_hear_of_reference() const;
  [[nodiscard]] bool pointer_is_seen() const;
  [[nodiscard]] std::optional<Touch> pointer_held() const;
  [[nodiscard]] std::optional<CheckReading> check_reading() const;
  /// By the landmark or fiducial that the pointer is held to, where it is held to one.
  void check_registration();
  void check_undoubted(const std::optional<CheckReading>& reading);
  void check_in_doubt(const CheckReading& reading);
  void note_off(const CheckReading& reading, bool refuses);
  void refuse_registration(const CheckReading& by);
  void confirm_registration(const std::optional<CheckReading>& by);
  void watch_surface(HostTime now);
  void watch_motion(const wire::VideoFrame& frame);
  void take_up();
  void keep();
  /// Of the pointer; empty: nobody has said where it is.
  [[nodiscard]] const std::optional<Eigen::Vector3d>& tip_in_pointer_mm() const {
    return settings_.tip_in_pointer_mm ? settings_.tip_in_pointer_mm : record_tip_in_pointer_mm_;
  }
  void note_tip();
  void note_field(const std::string& unsigned_why);
  void add_touch(const Touch& touch);
  /// That may tell whether the registration holds: in doubt, those that were known before.
  [[nodiscard]] std::span<const NamedPoint> landmarks_that_count() const;
  [[nodiscard]] std::vector<NamedPoint> picked_landmarks() const;

  LiveSettings settings_;
  LiveStep step_ = LiveStep::connect;
  std::optional<LiveStep> return_to_;  ///< once what is held back comes back
  bool frozen_ = false, patient_confirmed_ = false;
  bool simulated_ = false;              ///< nobody lies there
  std::optional<HostTime> video_came_;  ///< the newest frame
  /// From when on the scope is missed: its newest pose, or later where the patient was touched since.
  std::optional<HostTime> scope_away_since_;
  std::optional<Duration> asleep_;   ///< how long this machine has slept, as it was last told
  std::optional<HostTime> watched_;  ///< the newest frame by which it was watched that video and poses agree
  bool guided_ = false;              ///< the scope was being calibrated over the board then
  ConnectedInstruments instruments_;
  PictureHardware taken_with_;
  ReferenceSensor reference_;
  std::string why_doubted_;  ///< why somebody has to look whether the registration holds; empty: as usual
  std::optional<Eigen::Vector3d> record_tip_in_pointer_mm_;  ///< by the record that is in force
  std::string resume_fault_;
  std::string record_sha256_;  ///< of the last record that was in force
  /// That no known machine signed the record that is in force, or the operation that was taken up; empty: one did.
  std::string record_doubt_, operation_doubt_;
  /// Of the map by which the appliance corrects poses. Once told it stays: what was found by such poses rests on it.
  std::string field_doubt_;
  std::optional<std::string> field_told_;           ///< of that map, as it was told last by this tracker's appliance
  std::optional<Eigen::Vector3d> touched_with_mm_;  ///< the tip, as somebody last touched or checked with it
  std::uint64_t shapes_ = 0;

  ConnectionStep connection_;
  CalibrationStep calibration_;
  PatientStep patient_;
  std::optional<HostTime> confirmed_at_;  ///< by Space or the pedal
  PlacePicks picks_;
  std::string pick_line_;
  PointerTip pointer_;
  HostTime heard_{};                           ///< now, as it was last told
  std::optional<HostTime> first_heard_;        ///< of this connection
  std::optional<HostTime> pointer_was_;        ///< when the newest pose of the pointer was measured, at the earliest
  std::optional<Eigen::Vector3d> fits_at_mm_;  ///< in doubt, the first place at which it fits; patient frame
  PlacesOff off_;
  std::size_t landmarks_before_doubt_ = 0;  ///< that were known as the registration came into doubt
  FiducialStep fiducials_;
  std::optional<std::size_t> asked_to_take_back_;
  ViewStep views_;
  OrganStrokes strokes_;
  std::optional<double> tip_rms_mm_;  ///< of the tip's calibration, where the record has it
  DeformationStep deformation_;
  WatchedSurface matched_;  ///< what the deformation is, or is being, found by
  SurfaceWatch watch_;
  OrganMotion motion_;
  VideoWatch video_;
  std::optional<CheckedLandmark> checked_;  ///< of the registration and the deformation that are shown
  StepNote check_, run_;
  OperationKeeper keeper_;
  LivePicture picture_;
};

}  // namespace birdseye::host
