#include "host/overlay/frame_painter.hpp"

#include "host/overlay/compositor.hpp"
#include "host/overlay/surface_cues.hpp"

namespace birdseye::host {

std::vector<std::uint8_t> lay_over(std::span<const std::uint8_t> video, const ImageRgba& overlay, double strength,
                                   const OverlayLook& look) {
  std::vector<std::uint8_t> in_front;
  if (look.surface_in_front) in_front = surface_cues({video, overlay.width_px, overlay.height_px});
  return composite(video, overlay, strength * look.opacity, in_front);
}

void FramePainter::set_setup(std::optional<Setup> setup, const TrustFigures& figures) {
  setup_ = std::move(setup);
  figures_ = figures;
  gate_ = OverlayGate(settings_);
  gate_.set_figures(figures_);
}

OverlayGate::Decision FramePainter::decide(const wire::VideoFrame& frame) {
  if (newest_ && frame.info.acquired < *newest_) {
    gate_ = OverlayGate(settings_);  // another clock: the times of one gate do not go back
    gate_.set_figures(figures_);
  }
  newest_ = frame.info.acquired;
  return gate_.decide(frame.info.acquired, frame.info.pose);
}

bool FramePainter::fits(const wire::VideoFrame& frame) const {
  return !setup_ || (frame.width_px == setup_->camera.width_px && frame.height_px == setup_->camera.height_px);
}

std::optional<Transform<Camera, Patient>> FramePainter::camera_from_patient(
    const wire::VideoFrame& frame, const OverlayGate::Decision& decision) const {
  if (!setup_ || !fits(frame) || !decision.tracker_from_sensor || decision.strength <= 0) return std::nullopt;
  return setup_->camera_from_patient(*decision.tracker_from_sensor);
}

std::optional<FramePainter::Painted> FramePainter::paint(const wire::VideoFrame& frame,
                                                         const OverlayGate::Decision& decision, Engine& engine,
                                                         const OverlayLook& look) const {
  const auto from = camera_from_patient(frame, decision);
  if (!from) return std::nullopt;
  Painted out;
  out.camera_from_patient = *from;
  const ImageRgba overlay = engine.render(setup_->camera, out.camera_from_patient, look.render);
  out.rgb = lay_over(*frame.rgb, overlay, decision.strength, look);
  return out;
}

}  // namespace birdseye::host
