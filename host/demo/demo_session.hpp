#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "device/wire/messages.hpp"
#include "drivers/system/progress.hpp"
#include "host/demo/demo_report.hpp"
#include "host/files/film.hpp"
#include "host/files/picture.hpp"
#include "host/guide/guided_calibration.hpp"
#include "host/guide/live_stations.hpp"
#include "host/link/event_stream.hpp"
#include "host/operation/patient.hpp"
#include "host/operation/pointer_tip.hpp"
#include "host/overlay/frame_painter.hpp"
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
  Picture video, overlay;
};

/// One run of the demo: takes the appliance's events in order and does what the stage asks for.
class DemoSession {
 public:
  DemoSession(SimulatedCart& cart, const calibration::Pattern& board, const PatientPlan& patient, Film film,
              Progress& progress)
      : cart_(cart), patient_(patient), film_(std::move(film)), progress_(progress), stations_(board, "scope") {}

  /// Until the operation has ended and its last frame has come.
  Result<void> run(EventStream& stream);
  Result<void> finish();

  DemoFigures figures;
  std::vector<OverlaidFrame> overlaid;
  std::vector<KeptFrame> kept;
  std::optional<Setup> setup;

 private:
  [[nodiscard]] std::string stage_at(DeviceTime time) const;
  Result<void> take(const wire::Birds& birds);
  Result<void> take(const wire::VideoFrame& frame);
  void take_stations();
  Result<void> calibrate_and_register();
  Result<void> overlay(const wire::VideoFrame& frame);

  SimulatedCart& cart_;
  const PatientPlan& patient_;  ///< all that the appliance does not send
  Film film_;
  Progress& progress_;
  LiveStations stations_;
  GuidedStations seen_;
  PointerTip pointer_;
  std::vector<Eigen::Vector3d> touches_in_tracker_mm_;
  std::unique_ptr<Engine> engine_;
  FramePainter painter_;
  OverlayLook look_;
  std::optional<std::uint64_t> first_sequence_;
  std::optional<DeviceTime> last_measured_;
  std::vector<double> tracker_periods_s_;
};

}  // namespace birdseye::host
