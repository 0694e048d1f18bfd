#pragma once

#include <optional>
#include <string>
#include <vector>

#include "host/operation/operation_view.hpp"
#include "host/overlay/live_picture.hpp"
#include "host/window/age_strip.hpp"
#include "host/window/appearance.hpp"
#include "host/window/live_window.hpp"
#include "host/window/slice_view.hpp"
#include "host/window/theme.hpp"

namespace birdseye::host {

/// What a person asked for in a frame of the window.
struct PanelWishes {
  bool primary = false, next = false, undo = false, stroke = false, freeze = false, snapshot = false;
  bool cancel = false;                                                   ///< the matching that runs
  bool hide_or_show = false;                                             ///< the overlay
  bool slices = false;                                                   ///< opened, or closed
  bool inset = false;                                                    ///< the small picture shown, or not any more
  bool details = false;                                                  ///< all figures shown, or not any more
  bool large_slices = false;                                             ///< with more of the room, or with less
  bool retry = false;                                                    ///< to connect, where that was given up
  bool keys = false;                                                     ///< all of them shown, or not any more
  bool pick_marker = false, pick_landmark = false, drop_marker = false;  ///< at the slices' cross-hair
  std::optional<double> turn_rod_deg;                                    ///< of a scope whose rod turns
  std::optional<std::size_t> take_back;                                  ///< a touch, from 0
  std::optional<LiveStep> step;
  std::optional<OverlayLook> look;  ///< but for its cutting plane
  std::optional<bool> clip;
  std::optional<CuttingPlane> plane;
  std::optional<Room> room;
  std::optional<SliceView> slice_view;  ///< with another place, zoom or window
  std::optional<int> inset_corner;      ///< where it lies now
  std::optional<std::vector<TransferPoint>> transfer;
  std::string preset;
};

/// What the panels show beside the operation.
struct PanelFacts {
  const AgeStrip* ages = nullptr;
  double frames_per_s = 0;
  std::uint64_t frames_skipped = 0;
  const HuHistogram* histogram = nullptr;
  TransferEditor* editor = nullptr;
  std::string said;                 ///< a remark of the window's own: where a snapshot went
  std::string preset;               ///< of the colours; empty: none
  std::optional<SliceView> slices;  ///< empty: closed
  CuttingPlane plane;
  OverlayLook look;
  Room room = Room::dark;
  int inset_corner = 0;
  bool clip = false;
  bool recorded = false;        ///< the source is a recording
  bool keys = false;            ///< all keys are shown
  bool details = false;         ///< all figures are shown, not only that of the target
  bool pseudonymised = false;   ///< the patient's name and ID are not shown: the picture is to be kept
  bool large_slices = false;    ///< as large as the window's width lets them be
  bool preset_changed = false;  ///< by hand since
  bool inset = true;
};

/// Why steps that were done are doubted now, each reason once; the sides of the window show them beneath the steps.
std::vector<std::string> doubts_of(const OperationView& operation);
/// How wide the workflow beside the video is.
int side_px(float scale);
/// Draws workflow, picture and strip, and reads keys and buttons. shown: what of the picture may be shown now.
PanelWishes draw_panels(const LiveWindow& window, const OperationView& operation, const ShownPicture& shown,
                        const PanelFacts& facts);
/// The wish that a key stands for, as LiveWindow::keys names it; the window's texts name all of them ("all_keys").
void add_key(const std::string& key, const OperationView& operation, const PanelFacts& facts, PanelWishes& wishes);

}  // namespace birdseye::host
