#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "calibration/record/calibration_record.hpp"
#include "calibration/time/pose_history.hpp"
#include "drivers/minibird/bird_guard.hpp"
#include "host/operation/live_workflow.hpp"
#include "tests/support/scratch.hpp"
#include "tests/support/textured_scene.hpp"

/// An operation in virtual time: a patient, a scope, a pointer, and a surgeon at the window's workflow, without window,
/// wire and pictures' contents. What is true is known, and may be other than what the window is told.
namespace birdseye::testing {

/// What is true. A lie changes it, or what is told of it.
struct RehearsedTruth {
  Transform<Tracker, Patient> tracker_from_patient;
  Transform<Camera, Sensor> camera_from_sensor;
  CameraModel lens;
  Eigen::Vector3d tip_in_pointer_mm{0, 0, 150};
  Eigen::Vector3d target_mm;                      ///< patient frame, where it truly lies
  std::vector<Eigen::Vector3d> fiducials_mm;      ///< patient frame, where they truly lie
  Transform<Tracker, Tracker> told_from_tracker;  ///< what the unit reports of a true place
};

/// How the instruments err, one sigma an axis.
struct RehearsedNoise {
  double position_mm = 0.3, angle_deg = 0.1;
  double touch_mm = 0.3;  ///< of how the pointer is set on a marker, beside the tracker
};

/// A frame that was shown with a whole overlay.
struct GreenFrame {
  double at_s = 0;
  double error_mm = 0;   ///< of the target across the line of sight, as a length where it lies
  double radius_mm = 0;  ///< within which the window says it is, with a probability of 95 %
};

/// What the window showed for a while.
struct Watched {
  std::size_t frames = 0;
  std::vector<GreenFrame> green;
  double last_green_s = -1;          ///< since the watching began; below zero: there was none
  std::vector<std::string> reasons;  ///< why there was no overlay, each once
};

class Rehearsal {
 public:
  explicit Rehearsal(unsigned seed, const RehearsedNoise& noise = {});

  // What a lie may change, before or between the acts.
  RehearsedTruth truth;
  calibration::CalibrationRecord record;               ///< that the appliance has
  std::vector<Eigen::Vector3d> markers_mm;             ///< as the window is told of the fiducials in the CT
  std::vector<Eigen::Vector3d> told_markers_mm;        ///< as the file of fiducials has them; empty: as the CT has
  Eigen::Vector3d landmark_mm;                         ///< as it is told of the target
  std::vector<std::size_t> touched{0, 1, 2, 3, 4, 5};  ///< which fiducials the hand goes to, in turn
  std::vector<Eigen::Vector3d> beside_mm;              ///< by how much it misses each; missing: by nothing
  calibration::Identity tracker, camera;               ///< that are connected
  std::string scope_name = "scope", pointer_name = "pointer";
  Duration frame_stamp_off{0}, frame_delay = Duration::from_ms(20);
  bool hemisphere_wrong = false;  ///< the unit has every place on the other side of the transmitter
  /// A bird that is fixed on the patient, by its name; empty: there is none.
  std::string reference_name;
  Transform<Patient, Sensor> patient_from_reference{Eigen::Matrix3d::Identity(), {40, 90, -10}};
  bool frames_come = true, poses_come = true, frames_repeat = false, poses_repeat = false;
  bool picture_frozen = false, picture_flipped_x = false, picture_flipped_y = false;
  std::function<void(std::string&)> change_record;           ///< on its way to the window
  int width_px = 0, height_px = 0;                           ///< of the frames; 0: as the record's lens has it
  std::function<void(host::LiveSettings&)> settings;         ///< changes what the window is started with
  std::function<Eigen::Vector3d(double at_s)> organ_motion;  ///< of the target, patient frame

  /// Starts the window, connects it and has the record adopted, and looks about with the scope; true: the scope counts
  /// as calibrated.
  bool begin();
  /// The patient is confirmed, and each of the fiducials touched; true: the window registered.
  bool register_patient();
  /// The surgeon holds the pointer at the target and presses Space, whatever the window says; true: it goes on.
  bool check();
  /// The scope looks at the target for a while.
  Watched watch(double seconds);

  [[nodiscard]] host::LiveWorkflow& workflow() { return *workflow_; }
  /// The scope is moved quickly over the scene, as before anything is drawn: the video tells of its motion.
  void look_about();
  /// The scope has looked elsewhere, long enough for what was followed to be lost.
  void forget_video();
  /// Half of the organ is cut away.
  void resect() { scene_->halve(); }
  void tell_instruments();
  void give_record();

 private:
  void step(Watched* watched, double since_s);
  /// haste: 1, as one looks at one place; more, as one looks about.
  void look_on(double seconds, double haste, Watched* watched);
  void send_frame(double since_s);
  void draw_video(double since_s);
  void note_shown(Watched& watched, double since_s);
  void rest_at(const Eigen::Vector3d& in_patient_mm, int samples);
  void push_birds();
  [[nodiscard]] Transform<Camera, Patient> true_view() const;
  std::optional<wire::Bird> told(const std::string& name, const Transform<Tracker, Sensor>& pose);
  [[nodiscard]] Transform<Tracker, Sensor> noisy(const Transform<Tracker, Sensor>& pose);
  Eigen::Vector3d normal3(double sigma);

  RehearsedNoise noise_;
  std::mt19937 random_;
  Scratch scratch_;
  std::unique_ptr<host::LiveWorkflow> workflow_;
  PoseHistory history_;
  std::map<std::string, drivers::minibird::BirdGuard> guards_;
  std::vector<std::int16_t> scope_words_;  ///< of its last record
  Transform<Tracker, Sensor> scope_;
  Eigen::Matrix3d pointer_turn_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d tip_in_tracker_mm_{0, 0, 900};
  std::int64_t time_ms_ = 1000;
  double looked_s_ = 0;
  std::uint64_t sequence_ = 0;
  std::optional<wire::VideoFrame> frame_;
  std::unique_ptr<TexturedScene> scene_;
  std::vector<std::uint8_t> drawn_;  ///< of drawn_from_, where nothing has moved since
  std::optional<Eigen::Matrix4d> drawn_from_;
  CameraModel drawn_of_;
};

}  // namespace birdseye::testing
