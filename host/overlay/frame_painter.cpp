#include "host/overlay/frame_painter.hpp"

#include <algorithm>
#include <cmath>
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
  // How the noise throws the target about holds on for the same scope and target, seen from anywhere.
  const auto place = [](const std::optional<Setup>& of, const TrustFigures& by) -> std::optional<Eigen::Vector3d> {
    if (!of || !by.target_in_patient_mm) return std::nullopt;
    return of->camera_from_patient(Transform<Tracker, Sensor>()) * *by.target_in_patient_mm;
  };
  const auto target_mm = place(setup, figures);
  if (target_mm && target_mm != jitter_of_mm_) {
    jitter_ = {};
    single_poses_ = false;
    jitter_of_mm_ = target_mm;
  }
  setup_ = std::move(setup);
  figures_ = figures;
  gate_ = OverlayGate(settings_);
  gate_.set_figures(figures_);
}

void FramePainter::take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
  if (!setup_ || !figures_.target_in_patient_mm) return;
  if (!std::exchange(single_poses_, true)) jitter_ = {};
  jitter_.push(acquired, setup_->camera_from_patient(tracker_from_sensor) * *figures_.target_in_patient_mm);
}

FramePose FramePainter::pose_of(const wire::VideoFrame& frame,
                                const Transform<Camera, Patient>& camera_from_patient) const {
  FramePose out;
  out.camera_from_patient = camera_from_patient;
  out.position_sigma_mm = frame.info.pose.position_sigma_mm;
  out.jitter_mm = jitter_.rms_mm();
  // Before there are enough poses the sensor's own speed has to do, which knows nothing of its turning.
  out.target_speed_mm_s = jitter_.speed_mm_s().value_or(frame.info.pose.speed_mm_s);
  out.time_sigma =
      Duration::from_seconds(std::hypot(frame.info.acquired_sigma.seconds(), frame.info.pose.time_sigma.seconds()));
  out.latency_known = frame.info.latency.has_value();
  return out;
}

std::optional<TargetMark> FramePainter::target(const wire::VideoFrame& frame,
                                               const OverlayGate::Decision& decision) const {
  const auto from = camera_from_patient(frame, decision);
  return from ? target_mark(setup_->camera(), pose_of(frame, *from), figures_) : std::nullopt;
}

std::optional<Eigen::Vector3d> FramePainter::target_in_camera_mm(const wire::VideoFrame& frame) const {
  const auto& pose = frame.info.pose.tracker_from_sensor;
  const auto& target_mm = figures_.target_in_patient_mm;
  if (!setup_ || !target_mm || !pose) return std::nullopt;
  return setup_->camera_from_patient(*pose) * *target_mm;
}

OverlayGate::Decision FramePainter::decide(const wire::VideoFrame& frame) {
  if (newest_ && frame.info.acquired < *newest_) {
    gate_ = OverlayGate(settings_);  // another clock: the times of one gate do not go back
    gate_.set_figures(figures_);
  }
  newest_ = frame.info.acquired;
  std::optional<ErrorBudget> expected;
  if (const auto& pose = frame.info.pose.tracker_from_sensor; setup_ && pose) {
    const Transform<Camera, Patient> from = setup_->camera_from_patient(*pose);
    if (const auto& target_mm = figures_.target_in_patient_mm; target_mm && !single_poses_)
      jitter_.push(frame.info.acquired, from * *target_mm);
    expected = error_budget(setup_->camera(), pose_of(frame, from), figures_);
  }
  return gate_.decide(frame.info.acquired, frame.info.pose, expected);
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
