#include "host/overlay/frame_overlay.hpp"

#include "host/overlay/compositor.hpp"

namespace birdseye::host {

FrameOverlay::FrameOverlay(const Setup& setup, const OverlayGate::Calibration& calibration, Engine& engine,
                           const RenderSettings& settings)
    : setup_(setup), engine_(engine), settings_(settings) {
  gate_.set_calibration(calibration);
}

FrameOverlay::Drawn FrameOverlay::draw(const wire::VideoFrame& frame) {
  Drawn drawn;
  drawn.decision = gate_.decide(frame.info.acquired, frame.info.pose);
  const auto& tracker_from_sensor = drawn.decision.tracker_from_sensor;
  if (!tracker_from_sensor || drawn.decision.strength <= 0) {
    drawn.rgb = *frame.rgb;
    return drawn;
  }
  drawn.camera_from_patient = setup_.camera_from_patient(*tracker_from_sensor);
  const ImageRgba overlay = engine_.render(setup_.camera, *drawn.camera_from_patient, settings_);
  drawn.rgb = composite(*frame.rgb, overlay, drawn.decision.strength);
  return drawn;
}

}  // namespace birdseye::host
