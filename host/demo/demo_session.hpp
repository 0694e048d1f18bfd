#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "device/wire/messages.hpp"
#include "drivers/system/background.hpp"
#include "drivers/system/progress.hpp"
#include "host/demo/demo_report.hpp"
#include "host/files/film.hpp"
#include "host/files/picture.hpp"
#include "host/guide/guided_calibration.hpp"
#include "host/guide/live_rests.hpp"
#include "host/guide/live_stations.hpp"
#include "host/link/event_stream.hpp"
#include "host/operation/deformation_step.hpp"
#include "host/operation/instruments.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/pointer_tip.hpp"
#include "host/operation/view_step.hpp"
#include "host/overlay/frame_painter.hpp"
#include "host/overlay/video_watch.hpp"
#include "host/render/engine.hpp"
#include "host/simulated/simulated_cart.hpp"

namespace birdseye::host {

/// The patient of the cart in folder, with so many fiducials: the brightest markers that its CT shows, which must be
/// there.
Result<PatientPlan> read_with_fiducials(const std::filesystem::path& folder, int fiducials);

struct OverlaidFrame {
  std::uint64_t sequence;
  DeviceTime acquired;
  Transform<Camera, Patient> camera_from_patient;
};

struct KeptFrame {
  std::uint64_t sequence;
  Picture video;
  std::optional<Picture> rigid;  ///< with the CT as it was taken, where the overlay has the CT deformed
  Picture overlay;
};

/// One run of the demo: takes the appliance's events in order and does what the stage asks for. Where the scope is held
/// still about the liver, it keeps views and then matches the CT with them, on a thread of its own; frames that come
/// meanwhile wait for that.
class DemoSession {
 public:
  DemoSession(SimulatedCart& cart, const calibration::Pattern& board, std::shared_ptr<const PatientPlan> patient,
              Film film, Progress& progress)
      : cart_(cart),
        patient_(std::move(patient)),
        film_(std::move(film)),
        progress_(progress),
        stations_(board, "scope"),
        rests_("scope") {}

  /// Until the operation has ended and its last frame has come.
  Result<void> run(EventStream& stream);
  /// Waits for the deformation, where one was begun, and draws what waits for it.
  Result<void> finish();
  /// What the overlay shows deformed; null where it shows the CT as it was taken.
  [[nodiscard]] const DeformedOrgan* deformed() const { return deformation_.found().get(); }

  /// As the board gave it; empty before that.
  [[nodiscard]] const std::optional<ScopeSetup>& scope() const { return scope_; }

  DemoFigures figures;
  std::vector<OverlaidFrame> overlaid;
  std::vector<KeptFrame> kept;
  std::optional<Setup> setup;

 private:
  [[nodiscard]] std::string stage_at(DeviceTime time) const;
  Result<void> take(const wire::Birds& birds);
  Result<void> take(const wire::VideoFrame& frame);
  void take(const wire::Health& health);
  void take_stations();
  void begin_to_calibrate(const wire::VideoFrame& frame);
  Result<void> end_calibrating_and_register();
  void keep_views();
  void begin_to_deform();
  void note_deformed();
  Result<void> end_deforming();
  void take_scope(const wire::Birds& birds);
  void watch(const wire::VideoFrame& frame);
  void judge();
  Result<void> overlay(const wire::VideoFrame& frame);

  std::optional<ScopeSetup> scope_;
  GuidedStations seen_;
  VideoWatch video_;
  SimulatedCart& cart_;
  std::shared_ptr<const PatientPlan> patient_;  ///< all that the appliance does not send
  Film film_;
  Progress& progress_;
  LiveStations stations_;
  Background<Result<GuidedCalibration>> calibrating_;  ///< while the pointer touches
  PointerTip pointer_;
  std::vector<Eigen::Vector3d> touches_in_tracker_mm_;
  LiveRests rests_;
  ViewStep views_;
  DeformationStep deformation_;
  std::optional<HostTime> began_to_deform_;
  std::optional<double> deforming_took_s_;
  /// To be drawn once the deformation is known, and what tells meanwhile whether it may be.
  std::vector<std::variant<wire::VideoFrame, wire::Birds, wire::Health>> waiting_;
  ConnectedInstruments instruments_;
  Instruments found_with_;    ///< that the scope was calibrated and the patient registered with
  std::string why_no_setup_;  ///< empty while the instruments are those that it was found with
  std::unique_ptr<Engine> engine_;
  FramePainter painter_;
  OverlayLook look_;
  std::optional<std::uint64_t> first_sequence_;
  std::optional<DeviceTime> last_measured_;
  std::vector<double> tracker_periods_s_;
  bool calibrating_begun_ = false;
};

}  // namespace birdseye::host
