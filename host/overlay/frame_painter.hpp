#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "device/wire/messages.hpp"
#include "host/overlay/gate.hpp"
#include "host/overlay/margins.hpp"
#include "host/overlay/overlay_look.hpp"
#include "host/overlay/scope_setup.hpp"
#include "host/overlay/target_jitter.hpp"
#include "host/overlay/undistortion.hpp"
#include "host/render/engine.hpp"

namespace birdseye::host {

/// A picture of which somebody gives lens and pose.
struct Still {
  std::span<const std::uint8_t> video;  ///< of the camera's size, RGB, rows from the top; of another size it stays bare
  CameraModel camera;
  Transform<Camera, Patient> camera_from_patient;
  /// By which it was made of what the lens took; what that lens did not see stays bare.
  const FrameUndistorter* straightened_by = nullptr;
  const Margins* margins = nullptr;
};
struct PaintedStill {
  ImageRgba volume;               ///< alone, transparent where nothing of it is drawn
  std::vector<std::uint8_t> rgb;  ///< the video, and the volume over it as far as the gate allows
  Duration rendered_in;           ///< what the engine took
};
/// Draws the CT over a still as FramePainter does over a frame: the gate decides by the figures. Files hold none: who
/// gives them answers by vouched_for().
PaintedStill paint_still(const Still& still, Engine& engine, const OverlayLook& look, const TrustFigures& figures);

/// Draws the CT over frames of video where their poses are to be believed: asks the gate, renders and lays over. The
/// same frames in the same order give the same pictures to the bit.
class FramePainter {
 public:
  FramePainter() = default;
  explicit FramePainter(const OverlayGate::Settings& gate) : settings_(gate), gate_(gate) {}

  /// Without a setup nothing is drawn. What was believed by the one before has nothing to fade from.
  void set_setup(std::optional<Setup> setup, const TrustFigures& figures);
  [[nodiscard]] const std::optional<Setup>& setup() const { return setup_; }
  [[nodiscard]] const TrustFigures& figures() const { return figures_; }

  /// As the CT is shown: deformed, where it is. Null: there are none.
  void set_margins(std::shared_ptr<const Margins> margins) { margins_ = std::move(margins); }

  /// A pose of the scope's sensor, as they come: they tell how they scatter, and how fast the target goes. Where none
  /// come, the frames' poses have to do.
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor);
  [[nodiscard]] const TargetJitter& jitter() const { return jitter_; }
  /// By the frame's pose. Empty: nothing is drawn by a setup, or it has no target, or no pose.
  [[nodiscard]] std::optional<Eigen::Vector3d> target_in_camera_mm(const wire::VideoFrame& frame) const;
  /// Whether the frame may bear an overlay. Of every frame, in their order; a clock that goes back is another clock.
  OverlayGate::Decision decide(const wire::VideoFrame& frame);
  /// Where the overlay has the target in a frame of that decision. Empty: nothing is drawn, the target is out of view,
  /// or its error is not known.
  [[nodiscard]] std::optional<TargetMark> target(const wire::VideoFrame& frame,
                                                 const OverlayGate::Decision& decision) const;
  /// The frame is of the size that the camera was calibrated at; so it is where there is no setup.
  [[nodiscard]] bool fits(const wire::VideoFrame& frame) const;

  /// Where the frame's overlay is drawn from, by the decision on this frame. Empty: nothing is drawn over it.
  [[nodiscard]] std::optional<Transform<Camera, Patient>> camera_from_patient(
      const wire::VideoFrame& frame, const OverlayGate::Decision& decision) const;

  /// Where the frame was seen from, where that is to be believed, whether anything may be drawn over it or not.
  [[nodiscard]] std::optional<Transform<Camera, Patient>> seen_from(const wire::VideoFrame& frame,
                                                                    const OverlayGate::Decision& decision) const;

  struct Painted {
    Transform<Camera, Patient> camera_from_patient;
    std::vector<std::uint8_t> rgb;  ///< of the frame's size, rows from the top
  };
  /// By the decision on this frame. Empty: nothing is drawn over it.
  [[nodiscard]] std::optional<Painted> paint(const wire::VideoFrame& frame, const OverlayGate::Decision& decision,
                                             Engine& engine, const OverlayLook& look) const;

 private:
  [[nodiscard]] FramePose pose_of(const wire::VideoFrame& frame,
                                  const Transform<Camera, Patient>& camera_from_patient) const;

  OverlayGate::Settings settings_;
  OverlayGate gate_;
  TargetJitter jitter_;
  std::optional<Eigen::Vector3d> jitter_of_mm_;  ///< where a sensor at the tracker's origin would have its target
  bool single_poses_ = false;                    ///< the jitter is of them, not of the frames' poses
  std::optional<Setup> setup_;
  TrustFigures figures_;
  std::shared_ptr<const Margins> margins_;
  std::optional<DeviceTime> newest_;
};

}  // namespace birdseye::host
