#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calibration/time/clock.hpp"
#include "device/wire/messages.hpp"
#include "host/overlay/frame_overlay.hpp"
#include "host/overlay/gate.hpp"
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

/// The picture and its safety (design, section 7): each frame is overlaid with the pose that came with it, if the gate
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
    /// No overlay where the frame, or the newest measurement behind its pose, is older than this. With what it takes to
    /// notice, less than 150 ms.
    Duration most_age = Duration::from_ms(120);
    /// A frame older than this is said to be stopped video.
    Duration stopped = Duration::from_ms(300);
    /// Whoever shows it is late where it is still on the screen so long after it grew too old: something else has to
    /// take it away.
    Duration late = Duration::from_ms(18);
    OverlayGate::Settings gate = quick_to_fade();
  };

  LivePicture() : LivePicture(Settings{}) {}
  explicit LivePicture(const Settings& settings) : settings_(settings), gate_(settings.gate) {}

  /// engine: empty takes it away. Both must outlive this, or be taken away before.
  void set_engine(Engine* engine) { engine_ = engine; }
  [[nodiscard]] const RenderSettings& render() const { return render_; }
  void set_render(const RenderSettings& render) {
    render_ = render;
    redraw();
  }
  /// Whether the surface's edges and highlights stay before the overlay, so that it reads as inside.
  void set_surface_in_front(bool in_front) {
    surface_in_front_ = in_front;
    redraw();
  }
  void set_opacity(double opacity) {
    opacity_ = opacity;
    redraw();
  }
  /// Without it, or with a reason why not, nothing is drawn.
  void set_setup(std::optional<Setup> setup, const OverlayGate::Calibration& calibration);
  [[nodiscard]] const std::optional<Setup>& setup() const { return setup_; }
  /// Why there is none, in words, where there is none.
  void set_without_setup(const std::string& why) { without_setup_ = why; }

  /// A frame that has come; one that came before and was not drawn yet is skipped. exposed: when its exposure was, on
  /// this machine's clock; where that is not known, when it arrived.
  void take(const wire::VideoFrame& frame, HostTime exposed);
  /// Draws the newest frame, if that is still to be done: some tens of milliseconds.
  void draw();
  /// What of it may be shown at this moment.
  ShownPicture at(HostTime now);
  /// Has the newest frame drawn anew, with other settings.
  void redraw() { dirty_ = frame_.has_value(); }

  [[nodiscard]] const std::optional<wire::VideoFrame>& frame() const { return frame_; }
  [[nodiscard]] HostTime exposed() const { return exposed_; }
  [[nodiscard]] std::uint64_t frames_skipped() const { return skipped_; }
  /// Where the newest frame's overlay was drawn from.
  [[nodiscard]] const std::optional<Transform<Camera, Patient>>& camera_from_patient() const {
    return camera_from_patient_;
  }

 private:
  Settings settings_;
  OverlayGate gate_;
  OverlayGate::Calibration calibration_;
  Engine* engine_ = nullptr;
  RenderSettings render_;
  double opacity_ = 1;
  bool surface_in_front_ = false;
  std::optional<Setup> setup_;
  std::string without_setup_ = "the patient is not registered yet";
  std::optional<wire::VideoFrame> frame_;
  HostTime exposed_;
  OverlayGate::Decision decision_;
  std::optional<Transform<Camera, Patient>> camera_from_patient_;
  std::vector<std::uint8_t> overlaid_, stopped_;
  std::uint64_t changes_ = 0, skipped_ = 0;
  bool dirty_ = false;
  int kind_ = -1;
};

}  // namespace birdseye::host
