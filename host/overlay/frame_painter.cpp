#include "host/overlay/frame_painter.hpp"

#include <utility>

#include "drivers/system/clock.hpp"
#include "host/overlay/hole.hpp"
#include "host/overlay/outlines.hpp"

namespace birdseye::host {

namespace {

/// The CT and the margins, in the style and through the hole that are asked for.
ImageRgba draw_ct(const CameraModel& camera, const Transform<Camera, Patient>& camera_from_patient, Engine& engine,
                  const Margins* margins, const OverlayLook& look) {
  ImageRgba picture = engine.render(camera, camera_from_patient, look.render);
  if (look.style == OverlayStyle::outlines) picture = outlines_of(picture);
  if (margins != nullptr && look.margins) draw_margins(*margins, camera, camera_from_patient, picture);
  return look.hole_radius ? in_hole(picture, *look.hole_radius) : picture;
}

}  // namespace

PaintedStill paint_still(const Still& still, Engine& engine, const OverlayLook& look, const TrustFigures& figures) {
  PaintedStill out;
  const HostTime began = host_now();
  out.volume = draw_ct(still.camera, still.camera_from_patient, engine, still.margins, look);
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
  const ImageRgba overlay = draw_ct(setup_->camera(), out.camera_from_patient, engine, margins_.get(), look);
  out.rgb = lay_over(*frame.rgb, overlay, decision.strength, look);
  return out;
}

}  // namespace birdseye::host
