#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "calibration/geometry/camera_model.hpp"
#include "device/wire/messages.hpp"
#include "host/overlay/gate.hpp"
#include "host/render/engine.hpp"

namespace birdseye::host {

/// What calibration and registration found; with it a frame's pose gives where the CT lies before the camera.
struct Setup {
  CameraModel camera;
  Transform<Camera, Sensor> camera_from_sensor;
  Transform<Tracker, Patient> tracker_from_patient;

  [[nodiscard]] Transform<Camera, Patient> camera_from_patient(
      const Transform<Tracker, Sensor>& tracker_from_sensor) const {
    return camera_from_sensor * tracker_from_sensor.inverse() * tracker_from_patient;
  }
};

/// Draws the CT over frames of video, where their poses are to be believed: the same frames in the same order give the
/// same pictures to the bit.
class FrameOverlay {
 public:
  /// Keeps a reference to engine, which must outlive it.
  FrameOverlay(const Setup& setup, const OverlayGate::Calibration& calibration, Engine& engine,
               const RenderSettings& settings);

  struct Drawn {
    OverlayGate::Decision decision;
    std::optional<Transform<Camera, Patient>> camera_from_patient;  ///< empty where nothing was drawn
    std::vector<std::uint8_t> rgb;                                  ///< of the frame's size, rows from the top
  };
  /// A frame of the camera's size.
  Drawn draw(const wire::VideoFrame& frame);

 private:
  Setup setup_;
  OverlayGate gate_;
  Engine& engine_;
  RenderSettings settings_;
};

}  // namespace birdseye::host
