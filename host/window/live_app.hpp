#pragma once

#include <memory>
#include <optional>
#include <string>

#include "host/operation/decision_log.hpp"
#include "host/operation/live_source.hpp"
#include "host/operation/live_workflow.hpp"
#include "host/operation/publisher.hpp"
#include "host/window/age_strip.hpp"
#include "host/window/inset_view.hpp"
#include "host/window/live_panels.hpp"
#include "host/window/live_script.hpp"
#include "host/window/live_window.hpp"

namespace birdseye::host {

/// What a run of the window came to.
struct LiveFigures {
  /// From when the window was asked for: until it showed something, until the CT could be drawn, and until its
  /// fiducials were known.
  std::optional<double> window_s, ct_s, fiducials_s;
  std::uint64_t frames = 0, frames_skipped = 0, frames_overlaid = 0;
  double seconds = 0;
  AgeStrip ages;
  /// The oldest picture that bore an overlay when it was handed to the screen.
  double oldest_overlay_ms = 0;
  std::string picture_says;  ///< at the end: why there was no overlay; empty: there was
  int stood_still = 0;       ///< how often it was covered, for it showed nothing newer in time
};

/// The window at the cart: takes events from the source to the workflow, draws, and does what keys, buttons and the
/// script ask for. All on the caller's thread but what the parts do on their own.
class LiveApp {
 public:
  /// simulated: the patient that the source makes, to be read once it is there. publisher: null, nobody is told.
  LiveApp(std::unique_ptr<LiveWindow> window, std::unique_ptr<LiveSource> source, LiveSettings settings,
          PatientFiles simulated, std::optional<LiveScript> script, std::optional<DecisionLog> log,
          std::unique_ptr<Publisher> publisher);

  /// How the overlay is drawn, and the window, before anybody asks for something else. identify: snapshots name the
  /// patient.
  void begin_with(const OverlayLook& look, Room room, bool identify);
  /// Until the window is closed, the program is interrupted or the script ends.
  /// asked: when the program was started.
  Result<void> run(HostTime asked);
  /// After it: waits until what was found is kept, or cannot be, which the operation's fault says.
  void finish() { workflow_.finish(); }
  [[nodiscard]] const LiveFigures& figures() const { return figures_; }
  /// How the operation stands, and what its overlay is drawn by.
  [[nodiscard]] OperationView operation() const { return workflow_.view(); }
  [[nodiscard]] const std::optional<Setup>& setup() const { return workflow_.picture().setup(); }
  [[nodiscard]] std::optional<DecisionLog>& log() { return log_; }

 private:
  void take_events();
  void note_simulator();
  void draw();
  PanelWishes draw_window(const ShownPicture& shown, bool again = false);
  void grant(const PanelWishes& wishes);
  Result<bool> follow_script();
  void draw_inset();
  void draw_slices();
  PanelWishes with_scripted(PanelWishes wishes);
  void grant_look(const PanelWishes& wishes);
  void grant_slices(const PanelWishes& wishes);
  void publish(const ShownPicture& shown);
  void note_patient();
  void snapshot(const std::filesystem::path& path, const ShownPicture& shown);
  std::filesystem::path next_snapshot();
  void ask_for_shot(std::filesystem::path path);
  [[nodiscard]] bool shot_due(HostTime now) const;

  std::unique_ptr<LiveWindow> window_;
  std::unique_ptr<LiveSource> source_;
  std::string preset_;  ///< of the colours to begin with: its name, or its file's
  LiveWorkflow workflow_;
  OperationView operation_;  ///< as it stood when it was last looked at
  PatientFiles simulated_;
  std::optional<LiveScript> script_;
  std::optional<DecisionLog> log_;
  std::unique_ptr<Publisher> publisher_;
  LiveFigures figures_;
  PanelFacts facts_;
  HostTime asked_;
  std::vector<std::string> scripted_;     ///< keys that have not been granted yet
  std::optional<Eigen::Vector3d> place_;  ///< that the script points at, likewise
  TransferEditor editor_;
  std::optional<HuHistogram> histogram_;
  std::optional<InsetView> inset_;
  Background<Picture> slicing_;
  std::vector<SliceMark> marks_;
  bool slices_changed_ = false;
  HostTime inset_drawn_, drawn_, shot_asked_;
  Duration to_draw_;  ///< what the window last took, until it was shown
  std::filesystem::path shot_;
  std::uint64_t drawn_changes_ = 0;
  std::optional<std::uint64_t> drawn_sequence_;
  std::deque<HostTime> swaps_;  ///< of the last second's new frames
  bool sheet_read_ = false, identify_ = false;
  int shots_ = 0;
  Background<std::string> saving_;  ///< a snapshot; what to say of it
};

}  // namespace birdseye::host
