#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/time/clock.hpp"
#include "device/wire/messages.hpp"
#include "host/overlay/frame_painter.hpp"
#include "host/overlay/freshness.hpp"
#include "host/render/engine.hpp"

namespace birdseye::host {

/// What of the newest frame may be shown now.
struct ShownPicture {
  bool any = false;                                ///< a frame has come
  bool stale = false;                              ///< the video has stopped: it must not be taken for live
  bool overlaid = false;                           ///< rgb carries the overlay
  double strength = 0;                             ///< of the overlay, 0 to 1
  double age_ms = 0;                               ///< from the middle of the exposure until now
  std::string reason;                              ///< why the overlay is not whole; empty where it is
  const std::vector<std::uint8_t>* rgb = nullptr;  ///< the picture to show
  int width_px = 0, height_px = 0;
  std::uint64_t changes = 0;  ///< another number: other pixels
  /// From then on it must no longer be on the screen; empty: it says itself that it is not live.
  std::optional<HostTime> believe_until;
};

/// The picture and its safety: each frame is overlaid with the pose that came with it, if the gate
/// lets it; and whatever is shown loses its overlay when it is older than a moment, so that nothing stale is taken for
/// the truth. Times are given, never read: tests play them.
class LivePicture {
 public:
  static OverlayGate::Settings quick_to_fade() {
    OverlayGate::Settings settings;
    settings.fade = Duration::from_ms(100);
    return settings;
  }
  struct Settings {
    FreshnessLimits freshness;
    OverlayGate::Settings gate = quick_to_fade();
  };

  LivePicture() : LivePicture(Settings{}) {}
  explicit LivePicture(const Settings& settings) : settings_(settings), painter_(settings.gate) {}

  /// engine: empty, there is no CT to draw yet. The newest frame is drawn anew.
  void set_engine(std::shared_ptr<Engine> engine) {
    engine_ = std::move(engine);
    redraw();
  }
  [[nodiscard]] const OverlayLook& look() const { return look_; }
  /// As the CT is shown: deformed, where it is. Null: there are none.
  void set_margins(std::shared_ptr<const Margins> margins) {
    painter_.set_margins(std::move(margins));
    redraw();
  }
  /// Shows the video alone, or the overlay over it again. Whoever asks for it wants to see the organ at once.
  void hide(bool hidden) {
    hidden_ = hidden;
    redraw();
  }
  [[nodiscard]] bool hidden() const { return hidden_; }
  /// Whether somebody has asked that the picture stand still: it then goes grey, but stays bright.
  void freeze(bool frozen) {
    frozen_ = frozen;
    redraw();
  }
  void set_look(const OverlayLook& look) {
    look_ = look;
    redraw();
  }
  /// Without a setup nothing is drawn, and why_none says why, in words.
  void set_setup(std::optional<Setup> setup, const TrustFigures& figures, const std::string& why_none = {});
  [[nodiscard]] const std::optional<Setup>& setup() const { return painter_.setup(); }
  /// In words; empty: there is one.
  [[nodiscard]] std::string why_no_setup() const { return setup() ? std::string() : why_no_setup_; }
  [[nodiscard]] const TrustFigures& figures() const { return painter_.figures(); }

  /// A pose of the scope's sensor, as they come.
  void take(DeviceTime acquired, const Transform<Tracker, Sensor>& tracker_from_sensor) {
    painter_.take(acquired, tracker_from_sensor);
  }
  [[nodiscard]] const TargetJitter& jitter() const { return painter_.jitter(); }
  [[nodiscard]] std::optional<Eigen::Vector3d> target_in_camera_mm(const wire::VideoFrame& frame) const {
    return painter_.target_in_camera_mm(frame);
  }
  /// A frame that has come; one that came before and was not drawn yet is skipped.
  void take(const wire::VideoFrame& frame, const Exposure& exposed);
  /// Draws the newest frame, if that is still to be done: some tens of milliseconds.
  void draw();
  /// What of it may be shown at this moment.
  ShownPicture at(HostTime now);
  /// Has the newest frame drawn anew: the engine draws another CT.
  void redraw() { dirty_ = frame_.has_value(); }

  [[nodiscard]] const std::optional<wire::VideoFrame>& frame() const { return frame_; }
  [[nodiscard]] HostTime exposed() const { return exposed_.at; }
  [[nodiscard]] std::uint64_t frames_skipped() const { return skipped_; }
  /// Where the newest frame's overlay is drawn from; empty where nothing is drawn over it.
  [[nodiscard]] std::optional<Transform<Camera, Patient>> camera_from_patient() const;
  /// Where the newest frame's overlay has the target; empty where none is drawn, or it is out of view.
  [[nodiscard]] std::optional<TargetMark> target() const;
  /// What was decided on the newest frame.
  [[nodiscard]] const OverlayGate::Decision& decision() const { return decision_; }
  /// Where the newest frame was seen from, where that is to be believed; whether the organ has moved since or not.
  [[nodiscard]] std::optional<Transform<Camera, Patient>> seen_from() const;

 private:
  /// Why the newest frame may bear no overlay now, whatever the gate says of its pose; empty: it may.
  [[nodiscard]] std::string why_bare(const Freshness& fresh) const;

  Settings settings_;
  FramePainter painter_;
  std::shared_ptr<Engine> engine_;
  OverlayLook look_;
  std::string why_no_setup_ = "the patient is not registered yet";
  std::optional<wire::VideoFrame> frame_;
  Exposure exposed_;
  OverlayGate::Decision decision_;
  std::vector<std::uint8_t> overlaid_, stopped_;
  std::uint64_t changes_ = 0, skipped_ = 0;
  bool dirty_ = false, hidden_ = false, frozen_ = false;
  int kind_ = -1;
};

}  // namespace birdseye::host
