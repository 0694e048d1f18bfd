#include "host/overlay/frame_painter.hpp"

#include <algorithm>
#include <cmath>

#include "drivers/system/clock.hpp"
#include "host/overlay/surface_cues.hpp"

namespace birdseye::host {

namespace {

/// A rendered overlay over a picture: out = overlay * strength + video * (1 - alpha * strength). strength: as the gate
/// decided, in [0, 1]. An overlay of another size than the picture's would lie somewhere else, and is not drawn.
std::vector<std::uint8_t> lay_over(std::span<const std::uint8_t> video, const ImageRgba& overlay, double strength,
                                   const OverlayLook& look) {
  std::vector<std::uint8_t> out(video.begin(), video.end());
  const std::size_t pixels = overlay.rgba.size() / 4;
  if (video.size() != 3 * pixels) return out;
  std::vector<std::uint8_t> in_front;
  if (look.surface_in_front) in_front = surface_cues({video, overlay.width_px, overlay.height_px});
  // Eight bits of fraction: 256 is all of it.
  const int whole = static_cast<int>(std::lround(std::clamp(strength * look.opacity, 0.0, 1.0) * 256));
  for (std::size_t i = 0; i < pixels; ++i) {
    const std::uint8_t* const rgba = &overlay.rgba[4 * i];
    if (rgba[3] == 0) continue;
    const int w = in_front.size() == pixels ? whole * (255 - in_front[i]) / 255 : whole;
    const int keep = 255 * 256 - rgba[3] * w;
    for (std::size_t c = 0; c < 3; ++c) {
      const int value = rgba[c] * w * 255 + video[3 * i + c] * keep;
      out[3 * i + c] = static_cast<std::uint8_t>(std::min(255, (value + 255 * 128) / (255 * 256)));
    }
  }
  return out;
}

}  // namespace

PaintedStill paint_still(const Still& still, Engine& engine, const OverlayLook& look, const TrustFigures& figures) {
  PaintedStill out;
  const HostTime began = host_now();
  out.volume = engine.render(still.camera, still.camera_from_patient, look.render);
  out.rendered_in = host_now() - began;
  if (still.straightened_by != nullptr) still.straightened_by->hide_unseen(out.volume);
  out.rgb = lay_over(still.video, out.volume, decide_still(figures).strength, look);
  return out;
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
  return !setup_ || (frame.width_px == setup_->camera().width_px && frame.height_px == setup_->camera().height_px);
}

std::optional<Transform<Camera, Patient>> FramePainter::camera_from_patient(
    const wire::VideoFrame& frame, const OverlayGate::Decision& decision) const {
  if (!setup_ || !fits(frame) || !decision.tracker_from_sensor || decision.strength <= 0) return std::nullopt;
  return setup_->camera_from_patient(*decision.tracker_from_sensor);
}

std::optional<Transform<Camera, Patient>> FramePainter::seen_from(const wire::VideoFrame& frame,
                                                                  const OverlayGate::Decision& decision) const {
  if (!setup_ || !fits(frame) || !decision.tracker_from_sensor || !decision.believed) return std::nullopt;
  return setup_->camera_from_patient(*decision.tracker_from_sensor);
}

std::optional<FramePainter::Painted> FramePainter::paint(const wire::VideoFrame& frame,
                                                         const OverlayGate::Decision& decision, Engine& engine,
                                                         const OverlayLook& look) const {
  const auto from = camera_from_patient(frame, decision);
  if (!from) return std::nullopt;
  Painted out;
  out.camera_from_patient = *from;
  const ImageRgba overlay = engine.render(setup_->camera(), out.camera_from_patient, look.render);
  out.rgb = lay_over(*frame.rgb, overlay, decision.strength, look);
  return out;
}

}  // namespace birdseye::host
