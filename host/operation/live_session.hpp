#pragma once

#include <array>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calibration/points/point_fit.hpp"
#include "calibration/record/calibration_record.hpp"
#include "drivers/system/background.hpp"
#include "host/guide/guide_worker.hpp"
#include "host/link/event_stream.hpp"
#include "host/operation/patient.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/overlay/target_jitter.hpp"
#include "host/registration/rigid/touch_detector.hpp"
#include "host/registration/views/view_advice.hpp"
#include "host/registration/views/view_registration.hpp"

namespace birdseye::host {

/// The workflow, in its order.
enum class LiveStep { connect, calibrate, fiducials, views, deform, check, run };
inline constexpr std::size_t kLiveSteps = 7;
const char* name_of(LiveStep step);

struct LiveSettings {
  PatientFiles patient;
  std::string transfer = "tumour-and-vessels", engine = "cpu";
  std::string scope = "scope", pointer = "pointer";  ///< birds, by their names
  std::optional<calibration::Pattern> pattern;       ///< the board to calibrate with
  std::optional<Eigen::Vector3d> tip_in_pointer_mm;  ///< else by the record
  std::size_t fiducials = 0;                         ///< how many to touch; 0: as many as are wanted
  std::filesystem::path out;                         ///< where results go; empty: none are kept
  std::filesystem::path resume;                      ///< out of an earlier window, to go on from; or empty
};

/// How a step stands.
struct StepNote {
  bool done = false;
  std::string line;  ///< in words, for the workflow's side
};

/// A fiducial that was touched.
struct TouchedFiducial {
  Eigen::Vector3d tip_in_tracker_mm;
  double rms_mm = 0;  ///< of the tip while it rested
  std::optional<double> residual_mm;
};

/// A frame that the CT is matched with.
struct KeptView {
  wire::VideoFrame frame;
  Transform<Camera, Patient> camera_from_patient;
};

/// A registration that runs on a thread of its own, as far as it is.
struct DeformProgress {
  std::vector<float> similarity;  ///< nats, of each step so far; the resolution changes on the way
  std::string line;
};

/// What the pointer's tip is near to, in the CT as it is shown.
struct CheckReading {
  Eigen::Vector3d tip_in_patient_mm;
  std::string nearest;  ///< landmark or fiducial; empty: there is none
  double distance_mm = 0;
};

/// Where the overlay has the target, and how far from there it may be.
struct TargetMark {
  Eigen::Vector2d at_px;
  double rms_mm = 0;                    ///< the error that is to be expected, as a length in space
  double radius_px = 0, radius_mm = 0;  ///< in the picture, it is within with a probability of 95 %, as far as counted
  bool motion_counted = false;          ///< whether that counts how the organ has moved since the CT
};

/// The state of the operation, from the first connection to the running overlay; knows nothing of windows. Fed with the
/// appliance's events and with the time; long work is done on threads of its own.
class LiveSession {
 public:
  /// Reads the patient, if there is one, on a thread of its own; what is wrong there is told by fault().
  explicit LiveSession(LiveSettings settings);
  /// Reads another.
  void load(const PatientFiles& files);

  void take(const wire::Event& event, HostTime now, const std::optional<ClockGap>& clock);
  /// Collects what threads have finished.
  void tick();
  /// The link to the appliance came or went.
  void set_link(bool connected, const std::string& words);
  /// What only a simulated cart can tell without being asked.
  void set_sheet(const calibration::Pattern& pattern, const Eigen::Vector3d& tip_in_pointer_mm, std::size_t fiducials);

  // What a person does.
  void begin_calibration();
  void end_calibration();
  /// At once, by key or pedal: the tip's mean of the last quarter of a second.
  void touch();
  void undo_touch();
  /// The newest frame, with where its camera is, is one to match with.
  void keep_view();
  void undo_view();
  void begin_deform();
  void cancel_deform();
  void undo_deform();
  void go_on();  ///< to the next step, where this one is done
  void go_to(LiveStep step);
  /// What the space bar and the pedal do in the present step.
  void primary();
  [[nodiscard]] std::string primary_words() const;
  void undo();  ///< the last thing of the present step
  void set_frozen(bool frozen) { frozen_ = frozen; }

  [[nodiscard]] LiveStep step() const { return step_; }
  [[nodiscard]] const StepNote& note(LiveStep step) const { return notes_[static_cast<std::size_t>(step)]; }
  [[nodiscard]] bool connected() const { return connected_; }
  [[nodiscard]] const std::string& link_words() const { return link_words_; }
  [[nodiscard]] const std::optional<wire::Health>& health() const { return health_; }
  [[nodiscard]] const std::string& appliance_says() const { return appliance_says_; }
  [[nodiscard]] std::optional<GuideState> guide() const;
  [[nodiscard]] std::vector<std::string> guide_lines() const;
  [[nodiscard]] const std::optional<Verdict>& calibration_verdict() const { return calibration_verdict_; }
  [[nodiscard]] const std::vector<TouchedFiducial>& touches() const { return touches_; }
  [[nodiscard]] std::size_t fiducials_wanted() const { return settings_.fiducials; }
  [[nodiscard]] std::optional<double> fre_mm() const;
  [[nodiscard]] const std::string& registration_fault() const { return registration_fault_; }
  [[nodiscard]] const std::vector<KeptView>& views() const { return views_; }
  /// Empty where the patient is not registered or no frame has come.
  [[nodiscard]] std::optional<ViewAdvice> view_advice() const;
  [[nodiscard]] bool deforming() const { return deforming_.running(); }
  [[nodiscard]] DeformProgress deform_progress() const;
  [[nodiscard]] const std::optional<ViewRegistration>& deformation() const { return deformation_; }
  [[nodiscard]] std::optional<CheckReading> check() const;
  /// Of the first landmark, else of the CT's middle. From what is known: the fiducials, hand-eye held out, the
  /// tracker's noise, and the deformation, where there is one. Empty where no overlay is drawn, or it is out of view.
  [[nodiscard]] std::optional<TargetMark> target_mark() const;
  [[nodiscard]] const PatientPlan* patient() const { return patient_.get(); }
  /// The fiducials in the CT; empty as long as they are looked for.
  [[nodiscard]] const std::optional<std::vector<Eigen::Vector3d>>& markers_in_patient_mm() const {
    return markers_in_patient_mm_;
  }
  /// For threads that outlast the patient's stay here.
  [[nodiscard]] std::shared_ptr<const PatientPlan> shared_patient() const { return patient_; }
  /// Another number: another CT, or it is deformed in another way.
  [[nodiscard]] std::uint64_t shapes() const { return shapes_; }
  [[nodiscard]] const std::string& fault() const {
    return !fault_.empty() ? fault_ : !engine_fault_.empty() ? engine_fault_ : keeping_fault_;
  }
  [[nodiscard]] bool frozen() const { return frozen_; }
  LivePicture& picture() { return picture_; }
  [[nodiscard]] const LivePicture& picture() const { return picture_; }
  [[nodiscard]] const LiveSettings& settings() const { return settings_; }
  [[nodiscard]] Engine* engine() const { return engine_.get(); }
  [[nodiscard]] const std::optional<TransferFunction>& transfer() const { return transfer_; }
  /// By which the engine draws: that before, as long as an engine for another is being made.
  [[nodiscard]] const std::optional<TransferFunction>& drawn_by() const { return drawn_by_; }
  [[nodiscard]] std::string engine_name() const { return engine_ ? engine_->name() : ""; }
  /// The picture has these colours once an engine is made that draws by them.
  void set_transfer(const TransferFunction& transfer);

 private:
  struct Loaded {
    std::shared_ptr<const PatientPlan> patient;
    Result<std::unique_ptr<Engine>> engine;    ///< of what is shown
    std::optional<TransferFunction> transfer;  ///< that the engine draws by
  };

  void finish_loading(Result<Loaded> loaded);
  void finish_recolouring();
  void take(const wire::VideoFrame& frame, HostTime exposed);
  void take(const wire::Birds& birds);
  void take(const wire::Calibration& calibration);
  void adopt(const calibration::CalibrationRecord& record);
  void finish_guide(Result<GuidedCalibration> found);
  void add_touch(const Touch& touch);
  void fit();
  void update_setup();
  void finish_deform(Result<ViewRegistration> found);
  void show_deformation();
  void keep_operation();
  void resume();
  void expect_registration_error();
  void forget_deformation(const std::string& why);
  [[nodiscard]] Eigen::Vector3d target_in_patient_mm() const;
  [[nodiscard]] Eigen::Vector3d as_shown_mm(const Eigen::Vector3d& place_in_ct_mm) const;
  void use(Loaded& loaded);
  StepNote& at(LiveStep step) { return notes_[static_cast<std::size_t>(step)]; }

  LiveSettings settings_;
  LiveStep step_ = LiveStep::connect;
  std::array<StepNote, kLiveSteps> notes_;
  bool connected_ = false, frozen_ = false;
  bool calibrated_here_ = false;    ///< by the board, at calibrated_utc_: only a newer record of the appliance counts
  bool unconfirmed_ = false;        ///< the registration is an earlier window's, and nobody has looked whether it holds
  bool transfer_is_newer_ = false;  ///< than what engine_, or that of the CT that is being read, draws by
  bool forget_running_ = false;     ///< the deformation that is being found is by a setup that is no more
  std::string calibrated_utc_;
  std::string link_words_, appliance_says_, fault_, engine_fault_, registration_fault_, keeping_fault_;
  std::optional<wire::Health> health_;

  Background<Result<Loaded>> loading_;
  std::shared_ptr<const PatientPlan> patient_;
  Background<std::vector<Eigen::Vector3d>> finding_;
  std::optional<std::vector<Eigen::Vector3d>> markers_in_patient_mm_;
  std::uint64_t shapes_ = 0;
  std::optional<TransferFunction> transfer_, drawn_by_;
  std::unique_ptr<Engine> engine_;
  Background<Loaded> recolouring_;

  std::unique_ptr<GuideWorker> guide_;
  std::optional<Verdict> calibration_verdict_;
  std::optional<CameraModel> camera_;
  std::optional<Transform<Camera, Sensor>> camera_from_sensor_;
  std::optional<Transform<Tracker, Patient>> tracker_from_patient_;
  OverlayGate::Calibration known_;

  TouchDetector touch_detector_;
  std::deque<std::pair<DeviceTime, Eigen::Vector3d>> tips_;  ///< of the last quarter of a second
  std::vector<TouchedFiducial> touches_;
  std::optional<double> fre_mm_;
  std::vector<Eigen::Vector3d> fitted_in_patient_mm_;  ///< the fiducials that the registration is by
  LivePicture picture_;
  TargetJitter jitter_;

  std::vector<KeptView> views_;
  std::optional<ViewRegistration> deformation_;
  mutable std::mutex steps_mutex_;
  std::vector<float> steps_;
  Background<Result<ViewRegistration>> deforming_;  // the last: its thread uses what is above
};

}  // namespace birdseye::host
